use bytemuck::{Pod, Zeroable};
use caustics_trace::{Coverage, Photon};
use glam::Vec3;

/// A [`Photon`] as buffers of the GPU hold it: five rows of 16 bytes.
///
/// WGSL declares the same layout in `shaders/footprint_record.wgsl`. Records lie in one storage
/// buffer; beside it stands a buffer of counters, whose first word is the number of records.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FootprintRecord {
    /// Where the photon landed, in metres.
    pub position: [f32; 3],
    /// Its flux in watts, the red channel.
    pub flux_r: f32,
    /// How far away one neighbour landed, in metres: the first axis of the footprint.
    pub axis_u: [f32; 3],
    /// Its flux in watts, the green channel.
    pub flux_g: f32,
    /// The second axis of the footprint, in metres.
    pub axis_v: [f32; 3],
    /// Its flux in watts, the blue channel.
    pub flux_b: f32,
    /// Unit direction in which it travelled.
    pub incoming: [f32; 3],
    /// Index of the receiver among the world's objects, plus [`OVERLAP`](Self::OVERLAP) if the footprint
    /// overlaps others: [`receiver`](Self::receiver) and [`coverage`](Self::coverage) tell them apart.
    pub object: u32,
    /// Unit geometric normal of the receiver, on the side on which the photon landed.
    pub normal: [f32; 3],
    /// Number of the emitted photon that this is a part of, among those of all lights. Records are
    /// in the order of these numbers, and those of one photon in the order in which its branches
    /// landed.
    pub photon: u32,
}

impl FootprintRecord {
    /// What is added to the object of a photon whose footprint
    /// [overlaps](Coverage::overlaps) others.
    pub const OVERLAP: u32 = 1 << 31;

    /// Index of the receiver among the world's objects.
    #[must_use]
    pub fn receiver(&self) -> u32 {
        self.object & !Self::OVERLAP
    }

    /// How the footprint lies among those of other photons. One that is
    /// [reflected](Coverage::Reflected) is drawn as any that overlap, and told as one.
    #[must_use]
    pub fn coverage(&self) -> Coverage {
        if self.object & Self::OVERLAP == 0 {
            Coverage::Cell
        } else {
            Coverage::Overlap
        }
    }

    /// The flux in watts, for each channel.
    #[must_use]
    pub fn flux(&self) -> Vec3 {
        Vec3::new(self.flux_r, self.flux_g, self.flux_b)
    }

    /// The record of a photon whose emission has this number.
    #[must_use]
    pub fn numbered(photon: &Photon, number: u32) -> Self {
        let overlap = if photon.coverage.overlaps() {
            Self::OVERLAP
        } else {
            0
        };
        Self {
            position: photon.position.to_array(),
            flux_r: photon.flux.x,
            axis_u: photon.axes[0].to_array(),
            flux_g: photon.flux.y,
            axis_v: photon.axes[1].to_array(),
            flux_b: photon.flux.z,
            incoming: photon.incoming.to_array(),
            object: photon.object | overlap,
            normal: photon.normal.to_array(),
            photon: number,
        }
    }
}

impl From<&Photon> for FootprintRecord {
    /// The record of a photon whose number is not known: it is 0.
    fn from(photon: &Photon) -> Self {
        Self::numbered(photon, 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_keeps_what_a_photon_has() {
        let photon = Photon {
            position: Vec3::new(1.0, 2.0, 3.0),
            incoming: Vec3::NEG_Y,
            flux: Vec3::new(4.0, 5.0, 6.0),
            normal: Vec3::Y,
            axes: [Vec3::X, Vec3::Z],
            object: 7,
            events: 2,
            source: caustics_trace::FootprintSource::Differential,
            coverage: caustics_trace::Coverage::Cell,
        };
        let record = FootprintRecord::numbered(&photon, 8);
        let words: [u32; 20] = bytemuck::cast(record);
        let expected = [
            [1.0, 2.0, 3.0, 4.0],
            [1.0, 0.0, 0.0, 5.0],
            [0.0, 0.0, 1.0, 6.0],
        ];
        assert_eq!(
            words[..12],
            expected
                .as_flattened()
                .iter()
                .map(|it: &f32| it.to_bits())
                .collect::<Vec<_>>()
        );
        assert_eq!((words[15], words[19]), (7, 8));
        assert_eq!(record.flux(), photon.flux);
        assert_eq!((record.receiver(), record.coverage()), (7, Coverage::Cell));
        let overlapping = Photon {
            coverage: Coverage::Overlap,
            ..photon
        };
        let record = FootprintRecord::from(&overlapping);
        assert_eq!(
            (record.receiver(), record.coverage()),
            (7, Coverage::Overlap)
        );
        assert_eq!(record.object, 0x8000_0007);
    }
}
