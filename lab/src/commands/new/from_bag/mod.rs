//! A bag as a graph file: each line with its evidence as a comment.

mod orders;
mod reader;
mod sensor;
mod sheet;
mod unsure;

use std::{
    cmp::Ordering,
    fs,
    path::{Path, PathBuf},
};

use ratelab_bag::{Analysis, Bag, BagChain, BagError, BagNode, Kind, NamedEdge};
use ratelab_system::{MAX_CHAINS, graph_file::GraphFile};

use orders::{ThreadOrder, nearest};
use sheet::{GraphSheet, ValueTable, node_name, number};
use unsure::OpenQuestions;

use crate::{
    error::Error,
    output::{NewFolders, OutputFile, print_line, refuse_existing},
    program, reading,
};
use ratelab_recording::printable::shown;

/// The fewest messages of a sensor that nobody reads.
const MIN_COUNT: usize = 50;

/// The part of the outputs of a timer below which it does not repeat what it published.
const NO_REPEATS: f64 = 0.005;

/// A graph file, and the files beside it.
pub struct GraphOfBag {
    /// The graph file.
    pub text: String,
    /// Costs and lateness that it names.
    pub tables: Vec<ValueTable>,
    /// How long it runs until the end of the bag (s).
    pub seconds: f64,
}

/// The graph of a bag, as it is written.
struct Draft<'a> {
    analysis: &'a Analysis,
    /// The event time that is 0 in the file (ns).
    zero: i64,
    /// What is written, in order.
    sheet: GraphSheet,
    /// The nodes that are written, by topic.
    written: Vec<usize>,
    /// The names of topics in the file, and of the nodes after them.
    names: Vec<(String, String)>,
    /// How the nodes of each thread register.
    orders: &'a [ThreadOrder],
}

/// Writes the graph of `bag`, whose name is `name`, with its tables in the folder `data`; the nodes of
/// each thread register in these `orders`.
pub fn graph(
    bag: &Bag,
    analysis: &Analysis,
    name: &str,
    data: &str,
    orders: &[ThreadOrder],
) -> GraphOfBag {
    let begins = analysis.nodes.iter().filter_map(|node| {
        let chain = analysis.chain(node.topic)?;
        let begun = analysis.begun(chain.path[0], node.topic);
        begun
            .into_iter()
            .map(|(event, begin)| event.min(begin))
            .min()
    });
    let zero = begins.min().unwrap_or(0).saturating_sub(1_000_000_000);
    let mut draft = Draft {
        analysis,
        zero,
        sheet: GraphSheet::new(name, data),
        written: Vec::new(),
        names: sheet::names(bag.topics.iter().map(|topic| topic.name.as_str())),
        orders,
    };
    draft.sheet.line(&format!(
        "# from a bag of {} messages in {:.1} s; costs and lateness as measured, in {data}/",
        bag.messages(),
        bag.span() as f64 / 1e9
    ));
    for node in in_order(analysis) {
        draft.node(node);
    }
    draft.topics();
    draft.threads();
    draft.chains();
    let seconds = draft.in_file(analysis.end as f64) / 1e3;
    draft.sheet.finish(seconds)
}

/// Returns the nodes, each after what it reads.
fn in_order(analysis: &Analysis) -> Vec<&BagNode> {
    let depth = |node: &&BagNode| {
        let chain = analysis.chain(node.topic);
        chain.map_or(0, |chain| chain.path.len())
    };
    let mut nodes: Vec<&BagNode> = analysis.nodes.iter().collect();
    nodes.sort_by_key(depth);
    nodes
}

impl Draft<'_> {
    /// Writes a node, if it is known enough.
    fn node(&mut self, node: &BagNode) {
        let is_written = match node.kind {
            Kind::Sensor => self.sensor(node),
            _ => self.reader(node),
        };
        if is_written {
            self.written.push(node.topic);
        }
    }

    /// Returns the name of a topic in quotes.
    fn quoted(&self, topic: usize) -> String {
        sheet::quoted(&self.names[topic].0)
    }

    /// Returns the name of the node that publishes a topic: that of the topic.
    fn name(&self, topic: usize) -> String {
        self.names[topic].1.clone()
    }

    /// Returns the readers of a topic.
    fn readers(&self, topic: usize) -> impl Iterator<Item = &BagNode> {
        self.analysis.nodes.iter().filter(move |node| {
            let input = node.input.as_ref();
            input.is_some_and(|input| input.parent == topic || input.other == Some(topic))
        })
    }

    /// Returns all topics that the node of `topic` publishes.
    fn published(&self, topic: usize) -> String {
        let led = self
            .analysis
            .relations
            .leaders
            .iter()
            .enumerate()
            .filter(|(other, leader)| **leader == topic && *other != topic);
        let all: Vec<String> = std::iter::once(topic)
            .chain(led.map(|(other, _)| other))
            .map(|topic| self.quoted(topic))
            .collect();
        format!("publishes = [{}]", all.join(", "))
    }

    /// `time` since the beginning of the file (ms).
    fn in_file(&self, time: f64) -> f64 {
        (time - self.zero as f64) / 1e6
    }

    /// Writes the links of all topics that are read.
    fn topics(&mut self) {
        for topic in self.written.clone() {
            let mut readers = self.readers(topic).peekable();
            if readers.peek().is_none() {
                continue;
            }
            let transport = self.analysis.clocks.least_transport as f64 / 1e6;
            // What one reader lost says nothing against a surer one that lost nothing.
            let (mut lost, mut surest, mut depth) = (0.0_f64, 0.0, 1);
            for reader in readers {
                let of_reader = reader::lost(reader);
                match reader.confidence.total_cmp(&surest) {
                    Ordering::Greater => (lost, surest) = (of_reader, reader.confidence),
                    Ordering::Equal => lost = lost.max(of_reader),
                    Ordering::Less => {}
                }
                depth = depth.max(reader::depth(reader));
            }
            let mut link = Vec::new();
            if transport > 0.0 {
                link.push(format!("delay:{}", sheet::number(transport)));
            }
            if lost >= 0.003 {
                link.push(format!(
                    "loss:{}",
                    sheet::number((lost * 1e4).round() / 1e4)
                ));
            }
            let mut lines = vec![format!("\n[topic.{}]", self.quoted(topic))];
            if depth == 1 && self.readers(topic).any(reader::is_short) {
                lines.push("depth = 1   # a newer one took the place of what waited".to_owned());
            }
            if depth > 1 {
                lines.push(format!("depth = {depth}   # so many waited in the bag"));
            }
            if !link.is_empty() {
                lines.push(format!("link = \"{}\"", link.join(",")));
            }
            if lines.len() > 1 {
                lines.iter().for_each(|line| self.sheet.line(line));
            }
        }
    }

    /// Writes the executors of nodes that share a thread.
    fn threads(&mut self) {
        for (number, order) in (1..).zip(self.orders) {
            let names: Vec<String> = order
                .topics
                .iter()
                .map(|of| sheet::quoted(&self.name(*of)))
                .collect();
            let (kind, names) = (sheet::quoted(order.kind), names.join(", "));
            for line in [
                format!("\n[executor.thread{number}]"),
                format!("kind = {kind}   # none began while another one ran"),
                format!("nodes = [{names}]   # of all orders the nearest to the ages in the bag"),
            ] {
                self.sheet.line(&line);
            }
        }
    }

    /// Writes the chains: leaves first, longest first.
    fn chains(&mut self) {
        let is_leaf = |chain: &BagChain| self.readers(chain.topic).next().is_none();
        let is_written =
            |chain: &&BagChain| chain.path.iter().all(|topic| self.written.contains(topic));
        let mut chains: Vec<&BagChain> = self.analysis.chains.iter().filter(is_written).collect();
        chains.sort_by_key(|chain| (!is_leaf(chain), std::cmp::Reverse(chain.path.len())));
        for chain in chains.into_iter().take(MAX_CHAINS) {
            let Some(ages) = chain.ages else { continue };
            let mut path = Vec::new();
            let root = self.name(chain.path[0]);
            if self.sheet.has_source(&root) {
                let source = sheet::source_of(&root);
                path.extend([source.clone(), format!("/{source}")]);
            }
            for topic in &chain.path {
                path.extend([self.name(*topic), self.names[*topic].0.clone()]);
            }
            let path: Vec<String> = path.iter().map(|name| sheet::quoted(name)).collect();
            let (mean, p99) = (ages.mean / 1e6, ages.p99 as f64 / 1e6);
            let mut lines = vec![
                format!("\n# in the bag: mean {mean:.1} ms, p99 {p99:.1} ms over time"),
                format!("[chain.{}]", self.name(chain.topic)),
                format!("path = [{}]", path.join(", ")),
                format!("age_ms = {p99:.3}"),
                "share = 0.99".to_owned(),
                format!("bag_mean_ms = {mean:.3}"),
                format!("bag_p99_ms = {p99:.3}"),
            ];
            let OpenQuestions { unsure, open } = OpenQuestions::new(self.analysis, chain);
            for (key, why) in [("unsure", unsure), ("open", open)] {
                lines.extend(why.map(|why| format!("{key} = {}", sheet::quoted(&why))));
            }
            lines.iter().for_each(|line| self.sheet.line(line));
        }
    }
}

/// Writes the graph of the bag at `from` into `path`, which ends in .toml. `edges` are what the user
/// knows of it.
pub fn write(path: &Path, from: &Path, edges: &[String]) -> Result<(), Error> {
    let folder = path.with_extension("data");
    for new in [path, &folder] {
        refuse_existing("new", new)?;
    }
    let bag = reading::read_bag(from)?;
    let mut analysis = Analysis::with_edges(&bag, &edges_of(&bag, edges)?);
    let name = node_name(&path.file_stem().unwrap_or_default().to_string_lossy());
    let data = folder.file_name().unwrap_or_default().to_string_lossy();
    let graph =
        |analysis: &Analysis, orders: &[ThreadOrder]| graph(&bag, analysis, &name, &data, orders);
    let graph = nearest(&mut analysis, graph);
    if !graph.text.contains("\n[node.") {
        let why = "no node can be made of this bag: its topics need header stamps and a rate";
        return Err(Error::BadInput(format!("--from {}: {why}", from.display())));
    }
    GraphFile::parse(&graph.text).map_err(|why| {
        let from = from.display();
        Error::BadInput(format!(
            "--from {from}: no graph file can be made of this bag: {why}"
        ))
    })?;
    write_all(path, &folder, &graph)?;
    print_line(&said(path, &graph))?;
    reading::if_damaged(&bag)
}

/// Returns the edges that the user named, by topic.
fn edges_of(bag: &Bag, edges: &[String]) -> Result<Vec<NamedEdge>, Error> {
    let edge = |text: &String| {
        let edge: Result<NamedEdge, BagError> = NamedEdge::parse(bag, text);
        edge.map_err(|why| Error::BadInput(format!("--edge {text:?}: {why}")))
    };
    edges.iter().map(edge).collect()
}

fn write_all(path: &Path, folder: &Path, graph: &GraphOfBag) -> Result<(), Error> {
    let open = |path: &Path| OutputFile::open("new", path);
    let mut files: Vec<(PathBuf, &str)> = Vec::new();
    let unwritable = |why| Error::unwritable("new", folder, &why);
    let mut made = NewFolders::default();
    if !graph.tables.is_empty() {
        made = NewFolders::leading_to(folder).map_err(unwritable)?;
    }
    for table in &graph.tables {
        files.push((folder.join(&table.file), &table.text));
    }
    files.push((path.to_owned(), &graph.text));
    for (path, text) in files {
        let written = open(&path)?.write(text.as_bytes());
        if written.is_err() {
            // No part of a graph stays behind.
            let _ = fs::remove_dir_all(folder);
        }
        written?;
    }
    drop(made);
    Ok(())
}

/// Returns how the graph is run.
fn said(path: &Path, graph: &GraphOfBag) -> String {
    let (file, program) = (shown(path), program::name());
    let seconds = number(graph.seconds);
    format!(
        "{file}: {program} run {file} --clock virtual --duration-s {seconds} repeats the bag; read its \
         comments first"
    )
}
