//! Whole paths.

use super::space::{Bounce, PathSpace, Scattering};
use super::subpath::Subpath;
use luz_color::SampledSpectrum;

/// A vertex of a path or subpath, with its factors and the geometry of the edge behind it.
#[derive(Clone, Debug)]
pub struct Node<V> {
    /// Where.
    pub vertex: V,
    /// How the path scatters there.
    pub bounce: Bounce,
    /// `G` of the edge to the next vertex of the sequence; zero for the last.
    pub geometry: f32,
    /// The vertex's factors.
    pub scattering: Scattering,
}

impl<V: Clone> Node<V> {
    /// A vertex of which nothing else is known.
    pub fn unknown(vertex: &V) -> Self {
        Self { vertex: vertex.clone(), bounce: Bounce::Spread, geometry: 0.0, scattering: Scattering::NONE }
    }
}

/// A path from a light to the eye, `x₀ … x_k`.
#[derive(Clone, Debug)]
pub struct Path<V> {
    nodes: Vec<Node<V>>,
    /// Memory for whoever makes a path out of walks.
    spare: Vec<Node<V>>,
}

/// A product of many factors, which neither overflows nor underflows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// The spectrum, to be multiplied by `exp(ln_scale)`.
    pub spectrum: SampledSpectrum,
    /// The logarithm of its scale.
    pub ln_scale: f64,
}

impl<V> Default for Path<V> {
    fn default() -> Self {
        Self { nodes: Vec::new(), spare: Vec::new() }
    }
}

impl<V: Clone> Path<V> {
    /// The vertices from the light to the eye.
    pub fn nodes(&self) -> &[Node<V>] {
        &self.nodes
    }

    /// Number of vertices, `k + 1`.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Has it no vertices?
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Forgets all vertices.
    pub fn clear(&mut self) {
        self.nodes.clear();
    }

    /// Adds a vertex towards the eye, of which nothing is known yet.
    pub fn push(&mut self, vertex: V, bounce: Bounce) {
        self.nodes.push(Node { vertex, bounce, geometry: 0.0, scattering: Scattering::NONE });
    }

    /// The vertices, for a walk from the light to go on with.
    pub(crate) fn nodes_mut(&mut self) -> &mut Vec<Node<V>> {
        &mut self.nodes
    }

    /// An empty list with memory of its own, to be [given back](Self::give_back), so that nothing is allocated anew for every path.
    pub(crate) fn lend(&mut self) -> Vec<Node<V>> {
        self.spare.clear();
        std::mem::take(&mut self.spare)
    }

    /// Takes back what was lent.
    pub(crate) fn give_back(&mut self, spare: Vec<Node<V>>) {
        self.spare = spare;
    }

    /// Adds vertices of another path, with all that is known of them.
    pub fn extend_from(&mut self, nodes: &[Node<V>]) {
        self.nodes.extend_from_slice(nodes);
    }

    /// Adds the vertices of a walk from the eye, the last one first. Of the edges between them nothing is known.
    pub fn extend_from_reversed(&mut self, walk: &[Node<V>]) {
        self.nodes.extend(walk.iter().rev().cloned());
    }

    /// Says how vertex `i` scatters.
    pub fn set_bounce(&mut self, i: usize, bounce: Bounce) {
        if let Some(node) = self.nodes.get_mut(i) {
            node.bounce = bounce;
        }
    }

    /// The path of a connection: `s` vertices of a walk from the light and `t` of one from the eye, where `x0` stands for the first of
    /// all, if there is one (see [`Connection::light`](super::Connection::light)). All of it is to be [evaluated](Self::evaluate).
    pub fn join(&mut self, (light, s): (&Subpath<V>, usize), (eye, t): (&Subpath<V>, usize), x0: Option<&V>) {
        self.nodes.clear();
        self.nodes.extend(x0.map(Node::unknown));
        if s > 1 || x0.is_none() {
            self.nodes.extend_from_slice(&light.nodes[..s.min(light.len())]);
        }
        // With s = 0 the eye's walk has gone on to the light: nothing is connected.
        let connected = self.nodes.len().wrapping_sub(1);
        let from_eye = if s == 0 { t.saturating_sub(1) } else { t };
        let start = self.nodes.len();
        self.nodes.extend(eye.nodes[..from_eye.min(eye.len())].iter().rev().cloned());
        if s > 0 {
            for i in [connected, start] {
                if let Some(node) = self.nodes.get_mut(i) {
                    node.bounce = Bounce::Spread;
                }
            }
        }
    }

    /// Works out the factors of vertices `range`, and the geometry of the edges from them and to them. Visibility is not
    /// asked for.
    pub fn evaluate<P: PathSpace<Vertex = V>>(&mut self, space: &P, range: std::ops::Range<usize>) {
        let end = range.end.min(self.nodes.len());
        for i in range.start.saturating_sub(1)..end {
            self.nodes[i].geometry = match self.nodes.get(i + 1) {
                Some(next) => space.geometry(&self.nodes[i].vertex, &next.vertex),
                None => 0.0,
            };
        }
        for i in range.start..end {
            let light_side = i.checked_sub(1).map(|before| &self.nodes[before].vertex);
            let eye_side = self.nodes.get(i + 1).map(|node| &node.vertex);
            let Node { vertex, bounce, .. } = &self.nodes[i];
            self.nodes[i].scattering = space.scattering(light_side, vertex, eye_side, *bounce);
        }
    }

    /// `f(x)`, (1) of the [module](super).
    pub fn contribution(&self) -> Contribution {
        let mut product = Contribution { spectrum: SampledSpectrum::ONE, ln_scale: 0.0 };
        for (i, node) in self.nodes.iter().enumerate() {
            product.spectrum *= node.scattering.value;
            if i + 1 < self.nodes.len() {
                product.spectrum *= node.geometry;
            }
            let largest = product.spectrum.max_component();
            if !(1e-8..1e8).contains(&largest) {
                if !(largest > 0.0 && largest.is_finite()) {
                    return Contribution { spectrum: SampledSpectrum::ZERO, ln_scale: 0.0 };
                }
                product.spectrum *= 1.0 / largest;
                product.ln_scale += f64::from(largest).ln();
            }
        }
        product
    }

    /// The density with which a walk from the light makes vertex `i` after those before it. `first` is that of `x₀`.
    #[inline]
    pub fn density_from_light(&self, i: usize, first: f32) -> f32 {
        match i.checked_sub(1) {
            None => first,
            Some(before) => self.nodes[before].scattering.toward_eye * self.nodes[before].geometry,
        }
    }

    /// The density with which a walk from the eye makes vertex `i` after those behind it. `last` is that of `x_k`.
    #[inline]
    pub fn density_from_eye(&self, i: usize, last: f32) -> f32 {
        match self.nodes.get(i + 1) {
            None => last,
            Some(behind) => behind.scattering.toward_light * self.nodes[i].geometry,
        }
    }
}
