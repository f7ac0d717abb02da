//! The commands: a file holds one, or several that share an idea. Code that several files share is
//! outside of this folder: none imports another.

mod advise;
mod branch;
mod check;
mod exercise;
mod export;
mod grade;
mod help;
mod hunt;
mod lab;
mod look;
mod margins;
mod new;
mod readings;
mod recording;
mod replay;
mod run;
mod sweep;

use crate::{
    cli::{Command, CourseCommand},
    error::Error,
    program::Program,
};

/// Executes a command of `program`.
///
/// # Errors
/// [`Error`] with the cause.
pub fn execute(program: &Program, command: Command) -> Result<(), Error> {
    match command {
        Command::Lab(args) => lab::lab(program, &args),
        Command::Run(args) => run::run(program, &args),
        Command::Sweep(args) => sweep::sweep(program, &args),
        Command::Advise(args) => advise::advise(program, &args),
        Command::Hunt(args) => hunt::hunt(program, &args),
        Command::Margins(args) => margins::margins(program, &args),
        Command::Check(args) => check::check(program, &args),
        Command::New(args) => new::new(&args),
        Command::Look(args) => look::look(&args),
        Command::Replay(args) => replay::replay(program, &args),
        Command::Info(args) => recording::info(program, &args),
        Command::Verify(args) => recording::verify(program, &args),
        Command::Branch(args) => branch::branch(program, &args),
        Command::Table(args) => export::table(program, &args),
        Command::Trace(args) => export::trace(program, &args),
        Command::Export(args) => export::export(program, &args),
        Command::ExportWeb(args) => export::export_web(program, &args),
        Command::Picture(args) => lab::picture(program, &args),
        #[cfg(feature = "network")]
        Command::Up(args) => crate::network::up(program, &args),
        #[cfg(feature = "network")]
        Command::Node(args) => crate::network::node(program, &args),
        #[cfg(not(feature = "network"))]
        Command::Up(_) => Err(Error::without_network("up")),
        #[cfg(not(feature = "network"))]
        Command::Node(_) => Err(Error::without_network("node")),
        Command::Course(CourseCommand::Exercise(args)) => exercise::exercise(program, &args),
        Command::Course(CourseCommand::Grade(args)) => grade::grade(program, &args),
        Command::Course(CourseCommand::Tour(args)) => lab::tour(program, &args),
        Command::Keys => help::print_keys(program),
        Command::Completions { shell } => help::completions(program, shell),
        Command::Man { folder } => help::man(program, folder.as_deref()),
    }
}
