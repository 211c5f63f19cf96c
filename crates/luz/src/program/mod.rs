//! The command line: what is asked, what is said, and how it ends.

mod arguments;
mod chains;
mod compare;
mod exit;
mod filtering;
mod info;
mod interrupt;
mod keeper;
mod merge;
mod metropolis;
mod output;
mod piece_values;
mod pieces;
mod plan;
mod problems;
mod progress;
mod render;
mod report;
mod study;
mod threads;
mod trace;
mod values;

use arguments::{Arguments, Command};
use clap::{CommandFactory, Parser};
use exit::Exit;

/// Does what the command line asks for.
pub fn run() -> Exit {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // A closed pipe is no reason to complain.
            let _ = error.print();
            return if error.use_stderr() { Exit::Usage } else { Exit::Success };
        }
    };
    match arguments.command {
        Command::Render(arguments) => render::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Merge(arguments) => merge::run(&arguments),
        Command::Trace(arguments) => trace::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Filter(arguments) => filtering::filter(&arguments),
        Command::Tonemap(arguments) => filtering::tonemap(&arguments),
        Command::Enhance(arguments) => filtering::enhance(&arguments),
        Command::Denoise(arguments) => filtering::denoise(&arguments),
        Command::ExitCodes => exit::print(&format!("{}\n", exit::EXIT_CODES)),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "luz", &mut script);
            exit::print_bytes(&script)
        }
    }
}
