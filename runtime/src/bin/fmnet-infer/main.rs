//! `fmnet-infer`: two meshes in, a dense map out.

#[allow(rustdoc::broken_intra_doc_links, reason = "the comments are help texts, where [n] is a shape")]
mod args;
mod commands;
mod console;

use args::{Cli, Command};
use clap::Parser;
use console::Console;
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: fmnet::LargePages = fmnet::LargePages;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let console = Console::new(&cli.common);
    if let Some(threads) = cli.common.threads
        && let Err(e) = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()
    {
        console.warn(&format!("--threads {threads}: {e}"));
    }
    console::clean_up_on_interrupt();
    let outcome = match &cli.command {
        Command::Demo(args) => commands::demo::run(args, &console),
        Command::Match(args) => commands::matching::run(args, &console),
        Command::Batch(args) => commands::batch::run(args, &console),
        Command::Transfer(args) => commands::transfer::run(args, &console),
        Command::Features(args) => commands::features::run(args, &console),
        Command::Evaluate(args) => commands::evaluate::run(args, &console),
        Command::Inspect(args) => commands::inspect::run(args, &console),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console.error(&error);
            console::exit_code(&error)
        }
    }
}
