use glam::Vec3;

/// The direction and the length of a vector, or none for zero, NaN and infinity.
///
/// Scaled by its largest component first: in f32 the squares of components below 10^-19 or above
/// 10^19 leave the range in which a length can be taken.
pub(crate) fn direction_and_length(vector: Vec3) -> Option<(Vec3, f32)> {
    let scale = vector.abs().max_element();
    let scaled = vector / scale;
    let length = scaled.length();
    // False for the NaN that comes of zero, NaN and infinity.
    (length > 0.0 && scale.is_finite()).then(|| (scaled / length, scale * length))
}

/// The direction of a vector, or none for zero, NaN and infinity.
pub(crate) fn direction(vector: Vec3) -> Option<Vec3> {
    direction_and_length(vector).map(|(direction, _)| direction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shortest_and_longest_vectors_have_a_direction() {
        for size in [1e-45, 1e-38, 1e-20, 1.0, 1e20, 3e38] {
            assert_eq!(
                direction_and_length(Vec3::new(0.0, -size, 0.0)),
                Some((Vec3::NEG_Y, size))
            );
        }
        assert_eq!(
            direction_and_length(Vec3::new(3e-30, 0.0, 4e-30))
                .unwrap()
                .1,
            5e-30
        );
    }

    #[test]
    fn vectors_without_direction_have_none() {
        for vector in [
            Vec3::ZERO,
            Vec3::NAN,
            Vec3::INFINITY,
            Vec3::new(1.0, f32::NAN, 0.0),
        ] {
            assert_eq!(direction(vector), None, "{vector}");
        }
        assert_eq!(direction(Vec3::new(1.0, f32::NEG_INFINITY, 0.0)), None);
    }
}
