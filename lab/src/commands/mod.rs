//! The commands, a file each. Code that several of them share is outside of this folder:
//! none imports another.

mod advise;
mod branch;
mod check;
mod completions;
mod exercise;
mod export_web;
mod grade;
mod hunt;
mod info;
mod keys;
mod lab;
mod look;
mod man;
mod new;
mod picture;
mod replay;
mod run;
mod sweep;
mod table;
mod tour;
mod trace;
mod verify;

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
        Command::Check(args) => check::check(program, &args),
        Command::New(args) => new::new(&args),
        Command::Look(args) => look::look(&args),
        Command::Replay(args) => replay::replay(program, &args),
        Command::Info(args) => info::info(program, &args),
        Command::Verify(args) => verify::verify(program, &args),
        Command::Branch(args) => branch::branch(program, &args),
        Command::Table(args) => table::table(program, &args),
        Command::Trace(args) => trace::trace(program, &args),
        Command::ExportWeb(args) => export_web::export_web(program, &args),
        Command::Picture(args) => picture::picture(program, &args),
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
        Command::Course(CourseCommand::Tour(args)) => tour::tour(program, &args),
        Command::Keys => keys::print_keys(program),
        Command::Completions { shell } => completions::completions(program, shell),
        Command::Man { folder } => man::man(program, folder.as_deref()),
    }
}
