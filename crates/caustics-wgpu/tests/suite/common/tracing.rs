//! Photons traced on both sides, and what differs.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::OnceLock;

use caustics_scene::gltf::load_path;
use caustics_scene::{BvhOptions, SceneIntersector, World};
use caustics_trace::{
    Coverage, EmissionPlan, EnergyLedger, Fate, FootprintSource, LedgerEntry, Photon, PhotonTrail,
    TraceOptions, trace_photon, trace_plan,
};
use caustics_wgpu::glam::{DVec3, Vec3};
use caustics_wgpu::{
    FootprintRecord, PhotonBuffers, PhotonTracer, SceneBuffers, TraceCounters, TracePlan, wgpu,
};

use super::{shared_device, words};

/// The names of the ten scenes, with the ending.
pub(crate) const SCENES: [&str; 10] = [
    "p01_sphere.glb",
    "p02_sphere_box.glb",
    "p03_cognac.glb",
    "p04_sphere_in_box.glb",
    "p05_brass_ring.glb",
    "p06_wave_plane.glb",
    "p07_pool.glb",
    "p08_square.glb",
    "p09_cornell.glb",
    "p10_torus_cube.glb",
];

/// A world and what finds the hits in it.
pub(crate) struct Stage {
    pub(crate) world: World,
    pub(crate) rays: SceneIntersector,
}

impl Stage {
    pub(crate) fn new(world: World) -> Self {
        let rays = world.intersector(&BvhOptions::default()).unwrap();
        Self { world, rays }
    }

    /// One of the [`SCENES`].
    pub(crate) fn load(name: &str) -> Self {
        let path = [env!("CARGO_MANIFEST_DIR"), "../../tests/scenes", name];
        let path: PathBuf = path.iter().collect();
        Self::new(World::new(&load_path(path).unwrap().scene).unwrap())
    }

    pub(crate) fn plan(&self, options: &TraceOptions) -> TracePlan {
        TracePlan::new(&self.world, &self.rays, options).unwrap()
    }
}

/// The trails of all photons by the CPU, in the order of their numbers, with their footprints as
/// [`trace_plan`] leaves them: checked against the neighbours' and divided at edges, where the options
/// ask for it.
pub(crate) fn trails_by_cpu(stage: &Stage, options: &TraceOptions) -> Vec<PhotonTrail> {
    let Stage { world, rays } = stage;
    let plan = EmissionPlan::new(world, rays, options).unwrap();
    let trail = |photon| trace_photon(world, rays, &plan, options, photon).unwrap();
    let mut trails: Vec<_> = (0..plan.count()).map(trail).collect();
    let map = trace_plan(world, rays, &plan, options, &|_| {}).unwrap();
    let mut checked = map.photons.into_iter();
    for trail in &mut trails {
        let landed = std::mem::take(&mut trail.photons);
        let paths = std::mem::take(&mut trail.paths);
        for (photon, path) in landed.into_iter().zip(paths) {
            let first = checked.next().unwrap();
            let is_divided = first.source == FootprintSource::Divided;
            assert!(is_divided || photon.incoming == first.incoming);
            let mut parts = vec![first];
            // Four parts, and what they give back.
            if is_divided {
                parts.extend(checked.by_ref().take(4));
            }
            let after: DVec3 = parts.iter().map(|it| it.flux.as_dvec3()).sum();
            let gain = after - photon.flux.as_dvec3();
            let ledger = &mut trail.ledger;
            ledger.edge_gain += gain;
            ledger.divided_photons += u64::from(is_divided);
            let is_replaced = first.source == FootprintSource::Neighbour;
            ledger.replaced_differentials += u64::from(is_replaced);
            let stored = LedgerEntry {
                count: parts.len() as u64 - 1,
                flux: gain,
            };
            ledger.add(Fate::Stored, &stored);
            trail.paths.extend(parts.iter().map(|_| path));
            trail.photons.extend(parts);
        }
    }
    assert_eq!(checked.next(), None);
    let sum = |of: fn(&EnergyLedger) -> u64| trails.iter().map(|it| of(&it.ledger)).sum::<u64>();
    let replaced = sum(|it| it.replaced_differentials);
    assert_eq!(replaced, map.ledger.replaced_differentials);
    assert_eq!(sum(|it| it.divided_photons), map.ledger.divided_photons);
    trails
}

/// The shared device, and the tracer that its tests share.
pub(crate) fn shared_tracer()
-> Option<(&'static (wgpu::Device, wgpu::Queue), &'static PhotonTracer)> {
    static TRACER: OnceLock<PhotonTracer> = OnceLock::new();
    let gpu = shared_device()?;
    Some((gpu, TRACER.get_or_init(|| PhotonTracer::new(&gpu.0))))
}

/// What one photon stored, in order: a hash of the path, and the record.
pub(crate) type Stored = Vec<(u32, FootprintRecord)>;

/// What the GPU traced.
pub(crate) struct Traced {
    pub(crate) photons: Vec<Stored>,
    pub(crate) counters: TraceCounters,
}

/// Traces all photons of a plan in one batch, with room for this many records.
pub(crate) fn trace_on_gpu(
    (device, queue): &(wgpu::Device, wgpu::Queue),
    tracer: &PhotonTracer,
    stage: &Stage,
    plan: &TracePlan,
    capacity: u32,
) -> Traced {
    let scene = SceneBuffers::new(device, &stage.world).unwrap();
    let buffers = PhotonBuffers::new(device, plan.photons(), capacity).unwrap();
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    buffers.clear(&mut encoder);
    let all = 0..plan.photons();
    tracer
        .trace(device, &mut encoder, &scene, plan, all, &buffers)
        .unwrap();
    queue.submit([encoder.finish()]);
    read(device, queue, plan, &buffers)
}

/// Reads back what a batch that holds all photons has stored.
pub(crate) fn read(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    plan: &TracePlan,
    buffers: &PhotonBuffers,
) -> Traced {
    let counters = TraceCounters::new(&words(device, queue, buffers.counters()), plan).unwrap();
    let photons = records_of(device, queue, buffers, 0..plan.photons());
    let reachable: usize = photons.iter().map(Vec::len).sum();
    assert_eq!(reachable, counters.stored as usize);
    Traced { photons, counters }
}

/// Reads back what each photon of a batch has stored.
pub(crate) fn records_of(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    buffers: &PhotonBuffers,
    batch: Range<u32>,
) -> Vec<Stored> {
    let records = words(device, queue, buffers.records());
    let records: &[FootprintRecord] = bytemuck::cast_slice(&records);
    let paths = words(device, queue, buffers.paths());
    let starts = words(device, queue, buffers.starts());
    let stored = |(place, photon): (usize, u32)| {
        let range = starts[place] as usize..starts[place + 1] as usize;
        let stored = range.map(|record| {
            assert_eq!(records[record].photon, photon, "record {record}");
            (paths[record], records[record])
        });
        stored.collect()
    };
    (0..).zip(batch).map(stored).collect()
}

/// How many photons a message names of each cause.
const NAMED: usize = 10;

/// How the photons of both sides differ.
#[derive(Default)]
pub(crate) struct Difference {
    /// Photons whose path is not the same, by cause.
    pub(crate) paths: BTreeMap<&'static str, Vec<usize>>,
    /// The largest distance between landing points, relative to the size of the scene.
    pub(crate) position: f32,
    /// The largest difference of a flux, relative to the largest that the emitted photon has left.
    pub(crate) flux: f32,
    /// The largest difference of a footprint's axis, relative to the longer one.
    pub(crate) axes: f32,
    /// The largest difference of a unit vector.
    pub(crate) directions: f32,
    /// Records whose footprint overlaps others on one side alone.
    pub(crate) other_coverages: usize,
    /// Records of footprints that overlap others.
    pub(crate) overlaps: usize,
    /// Records whose every bit is the same, of so many on the same paths.
    pub(crate) equal_records: (usize, usize),
}

/// The first photons of each other path, not the whole lists.
impl fmt::Debug for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Difference")
            .field("paths", &self.first_of_paths())
            .field("position", &self.position)
            .field("flux", &self.flux)
            .field("axes", &self.axes)
            .field("directions", &self.directions)
            .field("other_coverages", &self.other_coverages)
            .field("overlaps", &self.overlaps)
            .field("equal_records", &self.equal_records)
            .finish()
    }
}

impl Difference {
    /// By cause how many photons took another path, and the first of them.
    pub(crate) fn first_of_paths(&self) -> BTreeMap<&'static str, (usize, &[usize])> {
        let paths = self.paths.iter();
        let first = paths.map(|(&cause, all)| {
            let named = all.len().min(NAMED);
            (cause, (all.len(), &all[..named]))
        });
        first.collect()
    }

    pub(crate) fn between(world: &World, trails: &[PhotonTrail], traced: &Traced) -> Self {
        assert_eq!(trails.len(), traced.photons.len());
        let size = world.bounds().diagonal().length();
        let mut difference = Self::default();
        for (number, (trail, stored)) in trails.iter().zip(&traced.photons).enumerate() {
            // A hash is of what the path met before it landed.
            let paths = stored
                .iter()
                .map(|(path, record)| (*path, record.receiver()));
            let objects = trail.photons.iter().map(|photon| photon.object);
            if paths.eq(trail.paths.iter().copied().zip(objects)) {
                let fluxes = trail.photons.iter().map(|photon| photon.flux.max_element());
                let scale = [size, fluxes.fold(0.0, f32::max)];
                for ((_, record), photon) in stored.iter().zip(&trail.photons) {
                    difference.compare(number as u32, photon, record, scale);
                }
            } else {
                let cause = if stored.len() == trail.paths.len() {
                    "other objects or events"
                } else {
                    "another number of parts"
                };
                difference.paths.entry(cause).or_default().push(number);
            }
        }
        difference
    }

    /// `scale` is the size of the scene, and the largest flux that the emitted photon has left.
    fn compare(
        &mut self,
        number: u32,
        photon: &Photon,
        record: &FootprintRecord,
        [size, brightest]: [f32; 2],
    ) {
        let expected = FootprintRecord::numbered(photon, number);
        let distance = |a: [f32; 3], b: [f32; 3]| Vec3::from(a).distance(b.into());
        let flux = record.flux() - photon.flux;
        let longer = photon.axes[0].length().max(photon.axes[1].length());
        let axes =
            distance(record.axis_u, expected.axis_u).max(distance(record.axis_v, expected.axis_v));
        let directions = distance(record.incoming, expected.incoming)
            .max(distance(record.normal, expected.normal));
        let position = distance(record.position, expected.position) / size;
        self.position = larger(self.position, position);
        // What parts give back is a difference of nearly equal numbers, or nothing.
        let relative = flux.abs().max_element() / brightest;
        self.flux = larger(self.flux, relative);
        if axes != 0.0 {
            self.axes = larger(self.axes, axes / longer);
        }
        self.directions = larger(self.directions, directions);
        let overlaps = photon.coverage.overlaps();
        self.other_coverages += usize::from(record.coverage().overlaps() != overlaps);
        self.overlaps += usize::from(record.coverage() == Coverage::Overlap);
        self.equal_records.0 += usize::from(*record == expected);
        self.equal_records.1 += 1;
    }

    /// How many photons took another path.
    pub(crate) fn other_paths(&self) -> usize {
        self.paths.values().map(Vec::len).sum()
    }

    /// Where an adapter rounds every operation, as software ones do, all bits are the CPU's.
    pub(crate) fn hold_bits(&self, device: &wgpu::Device, name: &str) {
        if device.adapter_info().device_type == wgpu::DeviceType::Cpu {
            assert_eq!(self.other_paths(), 0, "{name}");
            let (equal, all) = self.equal_records;
            assert_eq!(equal, all, "{name}");
        }
    }

    /// What exceeds the promise: one photon of a thousand may take another path; the others land
    /// within 10⁻⁴ of the scene's size, with a flux within 10⁻⁴ and a footprint within 10⁻³.
    pub(crate) fn beyond_promise(&self, photons: usize) -> Vec<String> {
        let mut beyond = Vec::new();
        if 1000 * self.other_paths() > photons {
            let causes = self.paths.iter().map(|(cause, all)| (cause, all.len()));
            beyond.push(format!("paths: {:?}", causes.collect::<Vec<_>>()));
        }
        for (what, found, limit) in [
            ("position", self.position, 1e-4),
            ("flux", self.flux, 1e-4),
            ("axes", self.axes, 1e-3),
            ("directions", self.directions, 1e-3),
        ] {
            if found.is_nan() || found > limit {
                beyond.push(format!("{what}: {found:e}"));
            }
        }
        beyond
    }
}

/// The larger, or the one that is not a number.
fn larger(a: f32, b: f32) -> f32 {
    if a >= b || a.is_nan() { a } else { b }
}

/// The sum of the trails' ledgers, and what was not aimed.
pub(crate) fn ledger_of(trails: &[PhotonTrail], plan: &TracePlan) -> EnergyLedger {
    let mut ledger = EnergyLedger::default();
    for trail in trails {
        ledger.merge(&trail.ledger);
    }
    let overlap = ledger.entry(Fate::Overlap).flux;
    ledger.emit_unaimed(plan.power() - (ledger.emitted().flux - overlap));
    ledger
}

/// Lines of two ledgers whose counts differ by more than a thousandth of the photons or whose flux
/// by more than 10⁻⁴ of what was emitted, and counts of differentials, likewise.
pub(crate) fn unlike_lines(a: &EnergyLedger, b: &EnergyLedger, photons: usize) -> Vec<String> {
    let emitted = a.emitted().flux.max_element();
    let unlike = |fate: &Fate| {
        let (one, other) = (a.entry(*fate), b.entry(*fate));
        let flux = (one.flux - other.flux).abs().max_element();
        1000 * one.count.abs_diff(other.count) > photons as u64 || flux > 1e-4 * emitted
    };
    let lines = Fate::ALL.into_iter().filter(unlike);
    let lines =
        lines.map(|fate| format!("{}: {:?}, {:?}", fate.name(), a.entry(fate), b.entry(fate)));
    let gains = [a, b].map(|it| it.edge_gain);
    let gained = (gains[0] - gains[1]).abs().max_element() > 1e-4 * emitted;
    let gained = gained.then(|| format!("silhouettes: {gains:?}"));
    let counts = [
        (
            "replaced",
            a.replaced_differentials,
            b.replaced_differentials,
        ),
        ("divided", a.divided_photons, b.divided_photons),
        ("bounded", a.bounded_differentials, b.bounded_differentials),
        ("fallbacks", a.normal_fallbacks, b.normal_fallbacks),
    ];
    let unlike = |(_, one, other): &(_, u64, u64)| 1000 * one.abs_diff(*other) > photons as u64;
    let counts = counts.into_iter().filter(unlike);
    let counts = counts.map(|(name, one, other)| format!("{name}: {one}, {other}"));
    lines.chain(gained).chain(counts).collect()
}
