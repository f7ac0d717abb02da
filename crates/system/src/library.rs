//! A graph of the library as a system.

use super::{BuildError, Builder, System};

/// A [`Graph`](ratelab::Graph) of the library as a system, by the function that adds its nodes:
/// the lab opens it as it is.
///
/// ```
/// use std::sync::Arc;
/// use ratelab::{Depth, Graph, Hz, Tick, Topic};
/// use ratelab_experiment::{Config, Experiment};
/// use ratelab_system::{BuildError, LibraryGraph};
///
/// fn wire(graph: &mut Graph) -> Result<(), BuildError> {
///     let count = Topic::new("/count", Depth::ONE);
///     graph.node("counter", Hz::new(10.0)?, 0, |wiring| {
///         let (count, mut number) = (wiring.publisher(&count), 0);
///         move |tick: &mut Tick| {
///             number += 1;
///             tick.publish(&count, number);
///         }
///     })?;
///     Ok(graph.node("reader", Hz::new(2.0)?, 1, |wiring| {
///         let mut count = wiring.subscription(&count);
///         move |tick: &mut Tick| {
///             tick.read(&mut count);
///         }
///     })?)
/// }
///
/// let system = LibraryGraph::new("counter", |builder| wire(builder.graph()));
/// let mut config = Config::default();
/// config.setup.set("rate reader 5".parse()?);
/// let summary = Experiment::new(Arc::new(system), &config)?.run()?;
/// assert_eq!(summary.topic("/count").expect("a topic").published, 101);
/// assert_eq!(summary.node("reader").map(|node| node.ticks), Some(51));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct LibraryGraph<F> {
    name: String,
    wire: F,
}

impl<F> LibraryGraph<F>
where
    F: Fn(&mut Builder<'_>) -> Result<(), BuildError> + Send + Sync + 'static,
{
    /// Creates the graph called `name` that `wire` adds to [`Builder::graph`].
    pub fn new(name: impl Into<String>, wire: F) -> Self {
        let name = name.into();
        Self { name, wire }
    }
}

impl<F> System for LibraryGraph<F>
where
    F: Fn(&mut Builder<'_>) -> Result<(), BuildError> + Send + Sync + 'static,
{
    fn name(&self) -> &str {
        &self.name
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        (self.wire)(builder)
    }
}
