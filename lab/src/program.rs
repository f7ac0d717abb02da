//! What the command works on, and what it is called.

use std::{env, path::Path, sync::Arc};

use ratelab::system::{KnobText, System};

/// The command for one system.
pub struct Program {
    /// What is run.
    pub system: Arc<dyn System>,
    /// Whether the course of the cart-pole belongs to it.
    pub course: bool,
}

impl Program {
    /// Reads and writes knobs with the names of the system.
    pub fn knobs(&self) -> KnobText {
        KnobText(self.system.aliases())
    }
}

/// The name by which the program was called.
pub fn name() -> String {
    let called = env::args_os().next().unwrap_or_default();
    let name = Path::new(&called)
        .file_stem()
        .and_then(|name| name.to_str());
    name.unwrap_or("ratelab").to_owned()
}
