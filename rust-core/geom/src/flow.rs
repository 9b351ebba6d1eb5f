//! Maximum flows, and the minimum cuts that they tell.
//!
//! Dinic's method \[Din70\]: flow goes along shortest ways only, all of one length at a time. Its cost is bounded by lengths of ways, which
//! are short where sources and sinks lie everywhere in the graph, as they do around a surface.

use base::error::Result;
use base::progress::{Pace, Progress};

/// A network: nodes with capacities from the source and to the sink, edges between nodes with a capacity each way.
#[derive(Clone, Debug)]
pub struct Network {
    /// From the source to a node if positive, from the node to the sink if negative: what both have in common flows at once.
    terminals: Vec<i64>,
    /// Units that flowed at once.
    flow: i64,
    edges: Vec<Edge>,
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    nodes: [u32; 2],
    /// From the first node to the second, and back.
    capacities: [u32; 2],
}

/// A minimum cut.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cut {
    /// Sum of the capacities cut, which is that of the largest flow.
    pub value: i64,
    /// Of each node, whether it is on the source's side. Of all minimum cuts that with the fewest nodes there: there is one.
    pub is_source: Vec<bool>,
}

/// No level, no node.
const NONE: u32 = u32::MAX;

impl Network {
    /// Without any capacity, and with room for so many edges.
    ///
    /// # Panics
    /// With 2^32 - 1 nodes or more.
    pub fn new(nodes: usize, edges: usize) -> Self {
        assert!(u32::try_from(nodes).is_ok_and(|nodes| nodes < NONE), "{nodes} nodes are too many for a network");
        Network { terminals: vec![0; nodes], flow: 0, edges: Vec::with_capacity(edges) }
    }

    /// Adds capacities from the source to a node, and from it to the sink.
    pub fn add_terminals(&mut self, node: u32, from_source: u32, to_sink: u32) {
        let before = self.terminals[node as usize];
        let (source, sink) = (before.max(0) + i64::from(from_source), (-before).max(0) + i64::from(to_sink));
        self.flow += source.min(sink);
        self.terminals[node as usize] = source - sink;
    }

    /// Adds capacities from one node to another, and back.
    ///
    /// # Panics
    /// With 2^31 edges or more, or capacities of that size.
    pub fn add_edge(&mut self, nodes: [u32; 2], capacities: [u32; 2]) {
        assert!(self.edges.len() < 1 << 31, "too many edges for a network");
        assert!(capacities.iter().all(|&capacity| capacity < 1 << 31), "capacities too large for a network");
        self.edges.push(Edge { nodes, capacities });
    }

    /// Capacity of each node from the source, less that to the sink. Negative if the sink's is the larger.
    pub fn terminals(&self) -> &[i64] {
        &self.terminals
    }

    /// The edges: their nodes, the capacities there and back.
    pub fn edges(&self) -> impl Iterator<Item = ([u32; 2], [u32; 2])> {
        self.edges.iter().map(|edge| (edge.nodes, edge.capacities))
    }

    /// Sum of the capacities that a cut with these nodes on the source's side goes through.
    pub fn price(&self, is_source: &[bool]) -> i64 {
        let at_terminals = self
            .terminals
            .iter()
            .zip(is_source)
            .map(|(&terminal, &is_source)| if is_source { (-terminal).max(0) } else { terminal.max(0) });
        let at_edges = self.edges.iter().map(|edge| match edge.nodes.map(|node| is_source[node as usize]) {
            [true, false] => i64::from(edge.capacities[0]),
            [false, true] => i64::from(edge.capacities[1]),
            _ => 0,
        });
        self.flow + at_terminals.sum::<i64>() + at_edges.sum::<i64>()
    }

    /// The smallest cut. O(n^2 m) at most for n nodes and m edges. Near m times the length of ways in practice.
    ///
    /// # Errors
    /// [`base::error::Error::Cancelled`].
    pub fn cut(self, progress: &Progress<'_>) -> Result<Cut> {
        let mut search = Search::new(self, progress)?;
        let mut pace = Pace::new(progress);
        while search.measure(&mut pace)? {
            search.push_all(&mut pace)?;
        }
        // Those that were reached are what is left to the source.
        Ok(Cut { value: search.flow, is_source: search.levels.iter().map(|&level| level != NONE).collect() })
    }
}

/// The residual network.
struct Search {
    terminals: Vec<i64>,
    flow: i64,
    edges: Vec<Edge>,
    /// First arc of each node. An arc's number is twice an edge's, plus one if the node is its second.
    first: Vec<u32>,
    arcs: Vec<u32>,
    /// Steps from the source.
    levels: Vec<u32>,
    /// Of each node, the arc that may still lead on.
    next: Vec<u32>,
    queue: Vec<u32>,
    /// Level at which the sink was met.
    end: u32,
}

impl Search {
    fn new(network: Network, progress: &Progress<'_>) -> Result<Self> {
        let Network { terminals, flow, edges } = network;
        let count = terminals.len();
        let mut first = vec![0_u32; count + 2];
        for block in progress.blocks(&edges) {
            block?.iter().flat_map(|edge| edge.nodes).for_each(|node| first[node as usize + 2] += 1);
        }
        for node in 2..first.len() {
            first[node] += first[node - 1];
        }
        let mut arcs = vec![0; 2 * edges.len()];
        for range in progress.ranges(edges.len()) {
            for edge in range? {
                for (side, node) in edges[edge].nodes.into_iter().enumerate() {
                    let place = &mut first[node as usize + 1];
                    arcs[*place as usize] = (2 * edge + side) as u32;
                    *place += 1;
                }
            }
        }
        first.pop();
        let (levels, next, queue) = (vec![NONE; count], vec![0; count], Vec::new());
        Ok(Search { terminals, flow, edges, first, arcs, levels, next, queue, end: NONE })
    }

    /// The end of an arc, and how much may still flow along it.
    fn arc(&self, arc: u32) -> (u32, u32) {
        let (edge, side) = (&self.edges[arc as usize / 2], arc as usize % 2);
        (edge.nodes[1 - side], edge.capacities[side])
    }

    /// Finds the levels of the nodes that flow can reach from the source, up to that at which the sink is met. Returns whether it is.
    fn measure(&mut self, pace: &mut Pace<'_>) -> Result<bool> {
        self.levels.fill(NONE);
        self.queue.clear();
        for node in 0..self.terminals.len() {
            if self.terminals[node] > 0 {
                self.levels[node] = 0;
                self.queue.push(node as u32);
            }
        }
        pace.after(self.levels.len() / 8)?;
        self.end = NONE;
        let mut place = 0;
        while place < self.queue.len() {
            let node = self.queue[place] as usize;
            place += 1;
            let level = self.levels[node];
            if level >= self.end {
                break;
            }
            pace.after(1)?;
            for at in self.first[node]..self.first[node + 1] {
                let (to, capacity) = self.arc(self.arcs[at as usize]);
                if capacity > 0 && self.levels[to as usize] == NONE {
                    self.levels[to as usize] = level + 1;
                    self.queue.push(to);
                    if self.terminals[to as usize] < 0 {
                        self.end = level + 1;
                    }
                }
            }
        }
        self.next.copy_from_slice(&self.first[..self.terminals.len()]);
        Ok(self.end != NONE)
    }

    /// Lets as much flow as can along ways that gain a level each step.
    fn push_all(&mut self, pace: &mut Pace<'_>) -> Result<()> {
        let mut way: Vec<u32> = Vec::new();
        let sources: Vec<u32> =
            self.queue.iter().copied().take_while(|&node| self.levels[node as usize] == 0).collect();
        for source in sources {
            way.clear();
            let mut here = source;
            while self.terminals[source as usize] > 0 {
                pace.after(1)?;
                if self.terminals[here as usize] < 0 {
                    here = self.push(source, here, &mut way);
                    continue;
                }
                match self.step(here) {
                    Some((arc, to)) => {
                        way.push(arc);
                        here = to;
                    }
                    None => {
                        let Some(arc) = way.pop() else { break };
                        here = self.edges[arc as usize / 2].nodes[arc as usize % 2];
                        self.next[here as usize] += 1;
                    }
                }
            }
        }
        Ok(())
    }

    /// An arc that leads on from a node, and where to.
    fn step(&mut self, node: u32) -> Option<(u32, u32)> {
        let level = self.levels[node as usize];
        while self.next[node as usize] < self.first[node as usize + 1] {
            let arc = self.arcs[self.next[node as usize] as usize];
            let (to, capacity) = self.arc(arc);
            if capacity > 0 && self.levels[to as usize] == level + 1 {
                return Some((arc, to));
            }
            self.next[node as usize] += 1;
        }
        None
    }

    /// Lets flow along a way as much as can, and shortens the way to where it can be left for another. Returns that place.
    fn push(&mut self, source: u32, sink: u32, way: &mut Vec<u32>) -> u32 {
        let room = self.terminals[source as usize].min(-self.terminals[sink as usize]);
        let amount = way.iter().map(|&arc| i64::from(self.arc(arc).1)).fold(room, i64::min);
        self.terminals[source as usize] -= amount;
        self.terminals[sink as usize] += amount;
        self.flow += amount;
        let mut full = None;
        for (place, &arc) in way.iter().enumerate() {
            let capacities = &mut self.edges[arc as usize / 2].capacities;
            let side = arc as usize % 2;
            // Back at most what both capacities were together.
            capacities[side] -= amount as u32;
            capacities[1 - side] += amount as u32;
            if capacities[side] == 0 && full.is_none() {
                full = Some(place);
            }
        }
        match full {
            Some(place) => {
                let arc = way[place];
                way.truncate(place);
                self.edges[arc as usize / 2].nodes[arc as usize % 2]
            }
            None => sink,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Nodes, capacities of the terminals, edges.
    type Plain = (Vec<[u32; 2]>, Vec<([u32; 2], [u32; 2])>);

    /// The value, and what the source reaches, by one way after another over a matrix of capacities.
    fn by_single_ways((terminals, edges): &Plain) -> Cut {
        let count = terminals.len();
        let (source, sink) = (count, count + 1);
        let mut capacities = vec![vec![0_i64; count + 2]; count + 2];
        for (node, &[from_source, to_sink]) in terminals.iter().enumerate() {
            capacities[source][node] += i64::from(from_source);
            capacities[node][sink] += i64::from(to_sink);
        }
        for &([a, b], [there, back]) in edges {
            capacities[a as usize][b as usize] += i64::from(there);
            capacities[b as usize][a as usize] += i64::from(back);
        }
        let mut value = 0;
        loop {
            let mut from = vec![usize::MAX; count + 2];
            from[source] = source;
            let mut stack = vec![source];
            while let Some(node) = stack.pop() {
                for to in 0..count + 2 {
                    if from[to] == usize::MAX && capacities[node][to] > 0 {
                        from[to] = node;
                        stack.push(to);
                    }
                }
            }
            if from[sink] == usize::MAX {
                return Cut { value, is_source: (0..count).map(|node| from[node] != usize::MAX).collect() };
            }
            let mut way = vec![sink];
            while way[way.len() - 1] != source {
                way.push(from[way[way.len() - 1]]);
            }
            let amount = way.windows(2).map(|pair| capacities[pair[1]][pair[0]]).min().unwrap();
            for pair in way.windows(2) {
                capacities[pair[1]][pair[0]] -= amount;
                capacities[pair[0]][pair[1]] += amount;
            }
            value += amount;
        }
    }

    fn network((terminals, edges): &Plain) -> Network {
        let mut network = Network::new(terminals.len(), edges.len());
        for (node, &[from_source, to_sink]) in (0..).zip(terminals) {
            network.add_terminals(node, from_source, to_sink);
        }
        edges.iter().for_each(|&(nodes, capacities)| network.add_edge(nodes, capacities));
        network
    }

    fn plain() -> impl Strategy<Value = Plain> {
        (2_u32..14).prop_flat_map(|count| {
            let edge = (0..count, 1..count, [0..6_u32, 0..6]);
            let edge = edge.prop_map(move |(from, step, capacities)| ([from, (from + step) % count], capacities));
            (prop::collection::vec([0..9_u32, 0..9], count as usize), prop::collection::vec(edge, 0..50))
        })
    }

    proptest! {
        /// Theorem: the value is that of the largest flow, the cut has it, and is the smallest of that value.
        #[test]
        fn cuts_as_single_ways_do(plain in plain()) {
            let cut = network(&plain).cut(&Progress::none()).unwrap();
            prop_assert_eq!(&cut, &by_single_ways(&plain));
            prop_assert_eq!(network(&plain).price(&cut.is_source), cut.value);
        }

        #[test]
        fn the_order_of_edges_does_not_matter(plain in plain()) {
            let turned = (plain.0.clone(), plain.1.iter().rev().copied().collect());
            let [a, b] = [&plain, &turned].map(|plain| network(plain).cut(&Progress::none()).unwrap());
            prop_assert_eq!(a, b);
        }
    }

    #[test]
    fn nothing_to_cut() {
        let cut = |plain: &Plain| network(plain).cut(&Progress::none()).unwrap();
        assert_eq!(cut(&(vec![], vec![])), Cut { value: 0, is_source: vec![] });
        // Capacities of the largest size.
        let most = (1 << 31) - 1;
        let line = (vec![[u32::MAX, 0], [0, 0], [0, u32::MAX]], vec![([0, 1], [most; 2]), ([1, 2], [most; 2])]);
        assert_eq!(cut(&line).value, i64::from(most));
    }
}
