//! The structure that finds what a ray hits: eight-wide trees on two levels.

mod binary;
mod collapse;
mod instance;

mod node;
mod pages;
mod simd;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

pub use instance::InstanceTransform;
pub use simd::SimdLevel;

use self::binary::Primitive;
use self::instance::Instance;
use self::node::{Child, Tree};
use self::simd::Level;
use self::simd::{All, Filter, Traversal};
use crate::{
    AreaSample, Bounds3, Hit, NO_INSTANCE, PreparedPrimitive, Ray, Reference, Shape, SolidAngleSample, SurfacePoint,
};

/// A shape in an [`Accelerator`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ShapeId(pub u32);

/// A set of shapes that can be placed in the world any number of times.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GroupId(u32);

/// One placement of a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct InstanceId(pub u32);

/// What was built, and what was left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BuildReport {
    /// Primitives in all trees, each group counted once.
    pub primitives: usize,
    /// Triangles among them.
    pub triangles: usize,
    /// Placements of groups.
    pub instances: usize,
    /// Primitives left out: vertices NaN or infinite, indices out of range, or no area. By shape, in order, those with any.
    pub skipped: Vec<(ShapeId, usize)>,
    /// Primitives left out because a tree holds no more (2²⁷ packets of four).
    pub overflow: usize,
    /// Bytes of nodes and leaves, meshes not counted.
    pub bytes: usize,
    /// Inner nodes.
    pub nodes: usize,
    /// Time from start to end of [`AcceleratorBuilder::build`].
    pub time: std::time::Duration,
}

/// Collects shapes; see [`Self::build`].
#[derive(Clone, Debug)]
pub struct AcceleratorBuilder {
    simd: SimdLevel,
    shapes: Vec<Shape>,
    filtered: Vec<bool>,
    /// The shapes of the world, then those of each group.
    groups: Vec<Vec<u32>>,
    instances: Vec<Instance>,
}

impl Default for AcceleratorBuilder {
    fn default() -> Self {
        Self::new()
    }
}

impl AcceleratorBuilder {
    /// Nothing yet.
    pub fn new() -> Self {
        Self {
            simd: SimdLevel::Auto,
            shapes: Vec::new(),
            filtered: Vec::new(),
            groups: vec![Vec::new()],
            instances: Vec::new(),
        }
    }

    /// Which instructions to use; what the machine lacks is replaced by the next best.
    pub fn simd(&mut self, level: SimdLevel) -> &mut Self {
        self.simd = level;
        self
    }

    /// Puts a shape into the world.
    pub fn add_shape(&mut self, shape: Shape) -> ShapeId {
        self.add_shape_to(GroupId(0), shape)
    }

    /// A new, empty group.
    pub fn add_group(&mut self) -> GroupId {
        self.groups.push(Vec::new());
        GroupId(self.groups.len() as u32 - 1)
    }

    /// Puts a shape into a group.
    pub fn add_shape_to(&mut self, group: GroupId, shape: Shape) -> ShapeId {
        let id = self.shapes.len() as u32;
        self.shapes.push(shape);
        self.filtered.push(false);
        self.groups[group.0 as usize].push(id);
        ShapeId(id)
    }

    /// Places a group in the world.
    pub fn add_instance(&mut self, group: GroupId, transform: InstanceTransform) -> InstanceId {
        self.instances.push(Instance::new(group.0, transform));
        InstanceId(self.instances.len() as u32 - 1)
    }

    /// Whether the filters of [`Accelerator::closest_hit_filtered`] and [`Accelerator::any_hit_filtered`] are asked about
    /// this shape; not, if not said.
    pub fn set_filtered(&mut self, shape: ShapeId, filtered: bool) {
        self.filtered[shape.0 as usize] = filtered;
    }

    /// Builds the trees, on all threads of the current rayon pool. The result does not depend on how many there are.
    pub fn build(self) -> Accelerator {
        let start = std::time::Instant::now();
        let Self { simd, shapes, filtered, groups, instances } = self;
        let mut report = BuildReport { instances: instances.len(), ..BuildReport::default() };
        let mut skipped = vec![0usize; shapes.len()];
        let mut trees: Vec<Tree> = Vec::with_capacity(groups.len());
        trees.push(Tree::default());
        for group in &groups[1..] {
            let primitives = gather(&shapes, group, &mut skipped);
            trees.push(grow(primitives, &shapes, &mut report));
        }
        let mut world = gather(&shapes, &groups[0], &mut skipped);
        world.extend(instances.iter().enumerate().filter_map(|(i, instance)| {
            let bounds = instance.bounds(&trees[instance.group as usize].bounds);
            bounds.is_finite().then(|| Primitive::other(&bounds, Primitive::INSTANCE, i as u32))
        }));
        trees[0] = grow(world, &shapes, &mut report);
        report.skipped =
            skipped.iter().enumerate().filter(|(_, n)| **n > 0).map(|(i, n)| (ShapeId(i as u32), *n)).collect();
        report.bytes = trees.iter().map(Tree::bytes).sum();
        report.nodes = trees.iter().map(|t| t.nodes.len()).sum();
        report.time = start.elapsed();
        Accelerator { shapes, filtered, trees, instances, level: Level::choose(simd), report }
    }
}

/// The valid primitives of some shapes.
fn gather(shapes: &[Shape], ids: &[u32], skipped: &mut [usize]) -> Vec<Primitive> {
    let total = ids.iter().map(|&id| shapes[id as usize].primitive_count()).sum();
    let mut all = Vec::with_capacity(total);
    for &id in ids {
        let shape = &shapes[id as usize];
        let is_triangle = matches!(shape, Shape::Triangles(_));
        let count = shape.primitive_count();
        let before = all.len();
        let one = |i: usize| {
            (i < Primitive::LIMIT as usize && shape.is_valid(i)).then(|| {
                let bounds = shape.bounds(i);
                if is_triangle {
                    Primitive::triangle(&bounds, id, i as u32)
                } else {
                    Primitive::other(&bounds, id, i as u32)
                }
            })
        };
        if count < 1 << 14 {
            all.extend((0..count).filter_map(one));
        } else {
            all.par_extend((0..count).into_par_iter().filter_map(one));
        }
        skipped[id as usize] += count - (all.len() - before);
    }
    all
}

/// The tree over some primitives.
fn grow(mut primitives: Vec<Primitive>, shapes: &[Shape], report: &mut BuildReport) -> Tree {
    report.overflow += primitives.len().saturating_sub(Child::LIMIT);
    primitives.truncate(Child::LIMIT);
    report.primitives += primitives.len();
    report.triangles += primitives.iter().filter(|p| !p.is_other()).count();
    Tree::build(primitives, shapes)
}

/// Shapes, and trees over them. Built by [`AcceleratorBuilder`].
#[derive(Debug)]
pub struct Accelerator {
    shapes: Vec<Shape>,
    filtered: Vec<bool>,
    /// That of the world, then those of the groups.
    trees: Vec<Tree>,
    instances: Vec<Instance>,
    level: Level,
    report: BuildReport,
}

impl Accelerator {
    /// What was built, and what was left out.
    pub fn report(&self) -> &BuildReport {
        &self.report
    }

    /// The instructions in use: never [`SimdLevel::Auto`].
    pub fn simd(&self) -> SimdLevel {
        self.level.name()
    }

    /// The box around everything, at all times.
    pub fn bounds(&self) -> Bounds3 {
        self.trees[0].bounds
    }

    /// The shapes, in the order of their ids.
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// One shape.
    pub fn shape(&self, id: ShapeId) -> &Shape {
        &self.shapes[id.0 as usize]
    }

    /// What the ray meets first at `0 < t ≤ t_max`. Of things at the same `t`: the least instance, shape, primitive.
    #[inline]
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.query::<_, false>(ray, &mut All)
    }

    /// Whether the ray meets anything at `0 < t ≤ t_max`.
    #[inline]
    pub fn any_hit(&self, ray: &Ray) -> bool {
        self.query::<_, true>(ray, &mut All).is_some()
    }

    /// As [`Self::closest_hit`], where hits on filtered shapes count only if `accept` says so. It may be asked about hits
    /// behind the one returned, in any order, and must give the same answer each time.
    #[inline]
    pub fn closest_hit_filtered(&self, ray: &Ray, mut accept: impl FnMut(&Hit) -> bool) -> Option<Hit> {
        self.query::<_, false>(ray, &mut accept)
    }

    /// As [`Self::any_hit`], where hits on filtered shapes count only if `accept` says so.
    #[inline]
    pub fn any_hit_filtered(&self, ray: &Ray, mut accept: impl FnMut(&Hit) -> bool) -> bool {
        self.query::<_, true>(ray, &mut accept).is_some()
    }

    #[inline(always)]
    fn query<F: Filter, const ANY: bool>(&self, ray: &Ray, filter: &mut F) -> Option<Hit> {
        let mut best = Hit {
            t: ray.t_max.min(f32::MAX),
            u: 0.0,
            v: 0.0,
            shape: u32::MAX,
            primitive: u32::MAX,
            instance: NO_INSTANCE,
        };
        let mut traversal = Traversal { accelerator: self, filter, instance: NO_INSTANCE };
        let level = self.level;
        level.walk::<F, ANY>(&mut traversal, &self.trees[0], ray, &mut best).then_some(best)
    }

    /// The surface at a hit of `ray`, in world space.
    #[inline]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        if hit.instance == NO_INSTANCE {
            self.shapes[hit.shape as usize].surface(ray, hit)
        } else {
            self.surface_of_instance(ray, hit)
        }
    }

    #[inline(never)]
    fn surface_of_instance(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let shape = &self.shapes[hit.shape as usize];
        let placement = &self.instances[hit.instance as usize].placement;
        let (local, skipped) = placement.to_object(ray);
        let point = shape.surface(&local, &Hit { t: hit.t - skipped, ..*hit });
        SurfacePoint { instance: hit.instance, ..placement.at(ray.time).surface(&point) }
    }

    /// The area of a primitive as it stands in its group, in square units; 0 where it was skipped.
    pub fn shape_area(&self, shape: ShapeId, primitive: u32) -> f32 {
        let shape = self.shape(shape);
        if shape.is_valid(primitive as usize) { shape.area(primitive as usize) } else { 0.0 }
    }

    /// A point of a primitive that stands in the world (not in a group), by area. `None` where it has no area.
    pub fn sample_area(&self, shape: ShapeId, primitive: u32, u: Vec2) -> Option<AreaSample> {
        self.shape(shape).sample_area(primitive as usize, u)
    }

    /// The density of [`Self::sample_area`] at a point of a shape, in area.
    pub fn pdf_area(&self, point: &SurfacePoint) -> f32 {
        self.shapes[point.shape as usize].pdf_area(point)
    }

    /// A point of a primitive that stands in the world (not in a group), as it is seen from `reference`. The point may be
    /// on a side that faces away. `None` where it has no finite density.
    pub fn sample_solid_angle(
        &self,
        reference: &Reference,
        shape: ShapeId,
        primitive: u32,
        u: Vec2,
    ) -> Option<SolidAngleSample> {
        self.shape(shape).sample_solid_angle(reference, primitive as usize, u)
    }

    /// A primitive that stands in the world (not in a group), prepared for [`Self::sample_solid_angle`] and its density;
    /// `None` where that would not make them faster.
    pub fn prepare(&self, shape: ShapeId, primitive: u32) -> Option<PreparedPrimitive> {
        PreparedPrimitive::new(self.shape(shape), primitive as usize)
    }

    /// The density of [`Self::sample_solid_angle`] at `point`, which is what a ray from `reference` meets, in solid angle.
    pub fn pdf_solid_angle(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        self.shapes[point.shape as usize].pdf_solid_angle(reference, point)
    }

    /// A number that depends on every byte of the trees: the same trees have the same, different ones hardly ever.
    pub fn fingerprint(&self) -> u64 {
        let mut hasher = std::hash::DefaultHasher::new();
        for tree in &self.trees {
            tree.hash_into(&mut hasher);
        }
        std::hash::Hasher::finish(&hasher)
    }

    /// The centre and radius of a sphere around everything.
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        self.bounds().bounding_sphere()
    }
}
