//! What is worth typing first: the end of each help, and of each manual page.

/// What all of them begin with.
pub const EXAMPLES: &str = "Examples:\n";

/// Of ratelab itself.
pub const RATELAB: &str = "\
Examples:
  ratelab                     watch the graph run; ? tells the keys
  ratelab run --help          the options of one command, and examples";

/// Of the lab.
pub const LAB: &str = "\
Examples:
  ratelab lab --speed 0.2               slow motion: a fall one can follow
  ratelab lab --control-hz 7 --record   a rate on the cliff, recorded";

/// Of a run.
pub const RUN: &str = "\
Examples:
  ratelab run --break                   decide 5 times a second: it falls
  ratelab run --clock virtual --record  the same to the bit every time, and kept";

/// Of a sweep.
pub const SWEEP: &str = "\
Examples:
  ratelab sweep --control-hz 5..10 --seeds 0..199 --theory
  ratelab sweep --policy scripted,lqr --queue-depth 1,100";

/// Of a replay.
pub const REPLAY: &str = "\
Examples:
  ratelab replay fall.rrd               in the rerun viewer
  ratelab replay --terminal fall.rrd    here, in the panes of the lab";

/// Of what a recording holds.
pub const INFO: &str = "\
Examples:
  ratelab info fall.rrd";

/// Of a verification.
pub const VERIFY: &str = "\
Examples:
  ratelab verify recordings/*.rrd";

/// Of the exercises.
pub const EXERCISE: &str = "\
Examples:
  ratelab exercise 1                    says what it is about, asks, measures
  ratelab exercise 1 --predict \"30 because fewer decisions come too late\"";

/// Of completions.
pub const COMPLETIONS: &str = "\
Examples:
  ratelab completions bash > ~/.local/share/bash-completion/completions/ratelab
  ratelab completions fish > ~/.config/fish/completions/ratelab.fish";

/// Of the manual.
pub const MAN: &str = "\
Examples:
  ratelab man | man -l -                read it now
  ratelab man ~/.local/share/man/man1   install it: man ratelab-run";
