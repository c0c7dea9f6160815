//! Validation of meshes, and the normals that they compute.

use caustics_geometry::glam::{Affine3A, Vec3};
use caustics_geometry::{MeshError, TriangleMesh, shapes};
use proptest::prelude::*;

fn corner() -> Vec<Vec3> {
    vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z]
}

#[test]
fn wrong_arrays_are_named() {
    let with = |vertex: usize, value: Vec3| {
        let mut positions = corner();
        positions[vertex] = value;
        TriangleMesh::new(positions, None, vec![[0, 1, 2]]).unwrap_err()
    };
    assert_eq!(
        with(2, Vec3::NAN),
        MeshError::NonFinitePosition { vertex: 2 }
    );
    // Also where no triangle uses the vertex.
    assert_eq!(
        with(3, Vec3::INFINITY),
        MeshError::NonFinitePosition { vertex: 3 }
    );
    assert_eq!(
        with(1, 1e19 * Vec3::X),
        MeshError::PositionOutOfRange {
            vertex: 1,
            limit: 1e18
        }
    );
    assert_eq!(
        TriangleMesh::new(corner(), None, vec![[0, 1, 2], [0, 4, 1]]).unwrap_err(),
        MeshError::IndexOutOfRange {
            triangle: 1,
            index: 4,
            vertices: 4
        }
    );
    assert_eq!(
        TriangleMesh::new(corner(), Some(vec![Vec3::Z; 3]), vec![]).unwrap_err(),
        MeshError::NormalCount {
            normals: 3,
            positions: 4
        }
    );
    let normals = vec![Vec3::Z, Vec3::Z, Vec3::NEG_INFINITY, Vec3::Z];
    assert_eq!(
        TriangleMesh::new(corner(), Some(normals), vec![]).unwrap_err(),
        MeshError::NonFiniteNormal { vertex: 2 }
    );
    let flat = TriangleMesh::with_flat_normals(&corner(), &[[0, 1, 9]]).unwrap_err();
    assert_eq!(
        flat,
        MeshError::IndexOutOfRange {
            triangle: 0,
            index: 9,
            vertices: 4
        }
    );
    assert_eq!(flat.to_string(), "triangle 0 uses vertex 9 of 4");
    assert_eq!(
        with(1, 1e19 * Vec3::X).to_string(),
        "position of vertex 1 has a coordinate beyond 1e18"
    );
}

#[test]
fn triangles_without_area_are_removed_and_counted() {
    let mut positions = corner();
    positions.push(2.0 * Vec3::X);
    let triangles = vec![[0, 0, 1], [0, 1, 2], [0, 1, 4], [3, 3, 3], [0, 2, 3]];
    let mesh = TriangleMesh::new(positions.clone(), None, triangles.clone()).unwrap();
    assert_eq!(mesh.removed_degenerate(), 3);
    assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3]]);
    let flat = TriangleMesh::with_flat_normals(&positions, &triangles).unwrap();
    assert_eq!(flat.removed_degenerate(), 3);
    assert_eq!(flat.triangles(), [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(flat.positions().len(), 6);
    assert_eq!(flat.normals()[..3], [Vec3::Z; 3]);
    assert_eq!(flat.normals()[3..], [Vec3::X; 3]);
    let nothing = TriangleMesh::new(vec![], None, vec![]).unwrap();
    assert!(nothing.bounds().is_empty() && nothing.area() == 0.0 && nothing.triangle(0).is_none());
}

#[test]
fn normals_come_out_of_unit_length() {
    let normals = vec![Vec3::ZERO, 1e-30 * Vec3::X, 1e30 * Vec3::Y, 5.0 * Vec3::Z];
    let mesh = TriangleMesh::new(corner(), Some(normals), vec![[0, 1, 2]]).unwrap();
    // The first from its triangle, the others scaled.
    assert_eq!(mesh.normals(), [Vec3::Z, Vec3::X, Vec3::Y, Vec3::Z]);
    assert_eq!(mesh.replaced_normals(), 1);
}

#[test]
fn smooth_normals_of_a_sphere_are_its_own() {
    let exact = shapes::icosphere(3.0, 4).unwrap();
    let smooth =
        TriangleMesh::new(exact.positions().to_vec(), None, exact.triangles().to_vec()).unwrap();
    for (computed, expected) in smooth.normals().iter().zip(exact.normals()) {
        assert!(computed.dot(*expected) > 0.999_99);
    }
    let flat = TriangleMesh::with_flat_normals(exact.positions(), exact.triangles()).unwrap();
    // Joined by position, it is the same closed solid.
    assert!(flat.is_closed());
    assert_eq!(flat.signed_volume(), exact.signed_volume());
}

#[test]
fn open_and_twisted_meshes_are_not_closed() {
    let tetrahedron = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let closed = |triangles: &[[u32; 3]]| {
        TriangleMesh::new(corner(), None, triangles.to_vec())
            .unwrap()
            .is_closed()
    };
    assert!(closed(&tetrahedron));
    assert!(!closed(&tetrahedron[..3]));
    assert!(!closed(&[[0, 1, 2], [0, 1, 3], [0, 3, 2], [1, 2, 3]]));
    let twice = [tetrahedron, tetrahedron].concat();
    assert!(!closed(&twice));
    let solid = TriangleMesh::new(corner(), None, tetrahedron.to_vec()).unwrap();
    assert!((solid.signed_volume() - 1.0 / 6.0).abs() < 1e-7);
}

#[test]
fn maps_that_flatten_or_overflow_are_told() {
    let sphere = shapes::icosphere(1.0, 1).unwrap();
    let flattened = sphere
        .transformed(&Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0)))
        .unwrap();
    assert!(
        flattened
            .normals()
            .iter()
            .all(|normal| (normal.length() - 1.0).abs() < 1e-6)
    );
    let point = sphere
        .transformed(&Affine3A::from_scale(Vec3::ZERO))
        .unwrap();
    assert_eq!(point.triangles().len(), 0);
    assert_eq!(point.removed_degenerate(), 80);
    let error = sphere
        .transformed(&Affine3A::from_scale(Vec3::splat(f32::NAN)))
        .unwrap_err();
    assert_eq!(error, MeshError::NonFinitePosition { vertex: 0 });
    assert!(
        sphere
            .transformed(&Affine3A::from_scale(Vec3::splat(1e30)))
            .is_err()
    );
}

proptest! {
    /// Whatever the bits, a mesh is an error or keeps its promises.
    #[test]
    fn any_bits_make_an_error_or_a_valid_mesh(
        bits in prop::collection::vec(prop::array::uniform3(any::<u32>()), 1..12),
        normal_bits in prop::collection::vec(prop::array::uniform3(any::<u32>()), 12),
        triangles in prop::collection::vec(prop::array::uniform3(0_u32..12), 0..12),
        with_normals in any::<bool>(),
    ) {
        let vectors = |bits: &[[u32; 3]]| -> Vec<Vec3> {
            // Exponents of 2 from -63 to 64, so that most vectors are finite.
            bits.iter().map(|b| Vec3::from(b.map(|b| f32::from_bits(b & 0xBFFF_FFFF)))).collect()
        };
        let positions = vectors(&bits);
        let normals = with_normals.then(|| vectors(&normal_bits[..bits.len()]));
        let Ok(mesh) = TriangleMesh::new(positions, normals, triangles.clone()) else {
            return Ok(());
        };
        prop_assert_eq!(mesh.triangles().len() + mesh.removed_degenerate(), triangles.len());
        prop_assert!(mesh.normals().iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
        for i in 0..mesh.triangles().len() {
            let normal = mesh.triangle(i).and_then(|triangle| triangle.unit_normal());
            prop_assert!(normal.is_some_and(|normal| (normal.length() - 1.0).abs() < 1e-5));
        }
        prop_assert!(mesh.area() >= 0.0);
        let _ = (mesh.is_closed(), mesh.signed_volume());
    }
}
