//! `fmnet-train`: trains the descriptor network through the functional map and exports it.

#[allow(rustdoc::broken_intra_doc_links, reason = "the comments are help texts, where [n] is a shape")]
mod args;
mod commands;
mod progress;

use args::{Cli, Command};
use clap::{CommandFactory, FromArgMatches};
use std::process::ExitCode;

fn main() -> ExitCode {
    let command = args::with_defaults(Cli::command());
    let cli = match Cli::from_arg_matches(&command.get_matches()) {
        Ok(cli) => cli,
        Err(e) => e.exit(),
    };
    if let Some(threads) = cli.common.threads
        && let Err(e) = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()
    {
        eprintln!("warning: --threads {threads}: {e}");
    }
    let outcome = match cli.command {
        Command::Synth(args) => commands::synth::run(&args, &cli.common),
        Command::Simulate(args) => commands::simulate::run(&args, &cli.common),
        Command::Preprocess(args) => commands::preprocess::run(&args, &cli.common),
        Command::Train(args) => commands::train::run(*args, &cli.common),
        Command::Export(args) => commands::export::run(&args, &cli.common),
        Command::Evaluate(args) => commands::evaluate::run(&args, &cli.common),
        Command::Reproduce(args) => commands::reproduce::run(&args, &cli.common),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}
