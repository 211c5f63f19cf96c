//! The program as its users meet it: arguments in; files, words and exit codes out.

mod bad_input;
mod command_line;
mod compare;
mod determinism;
mod filter;
mod info;
mod interrupt;
mod metropolis;
mod pieces;
mod render;
mod study;
mod support;
mod uses;
mod video;
