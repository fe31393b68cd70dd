//! `fmnet-train`: trains the descriptor network through the functional map and exports it.

#[allow(rustdoc::broken_intra_doc_links, reason = "the comments are help texts, where [n] is a shape")]
mod args;
mod commands;
mod interrupt;
mod progress;

use args::{Cli, Command};
use clap::{CommandFactory, FromArgMatches};
use fmnet::causes;
use fmnet::io::{IoError, print_error_line};
use fmnet_trainer::checkpoint::CheckpointError;
use fmnet_trainer::export::ExportError;
use fmnet_trainer::precompute::PrepareError;
use fmnet_trainer::reproduce::ReproduceError;
use fmnet_trainer::simulate::SimulateError;
use fmnet_trainer::synth::SynthError;
use fmnet_trainer::train::TrainError;
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: fmnet::LargePages = fmnet::LargePages;

fn main() -> ExitCode {
    let command = args::with_defaults(Cli::command());
    let cli = match Cli::from_arg_matches(&command.get_matches()) {
        Ok(cli) => cli,
        Err(e) => e.exit(),
    };
    if let Some(threads) = cli.common.threads
        && let Err(e) = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()
    {
        print_error_line(&format!("warning: --threads {threads}: {e}"));
    }
    interrupt::watch(matches!(cli.command, Command::Train(_) | Command::Reproduce(_)));
    let outcome = match cli.command {
        Command::Synth(args) => commands::synth::run(&args, &cli.common),
        Command::Simulate(args) => commands::simulate::run(&args, &cli.common),
        Command::Preprocess(args) => commands::preprocess::run(&args, &cli.common),
        Command::Train(args) => commands::train::run(*args, &cli.common),
        Command::Calibrate(args) => commands::calibrate::run(&args, &cli.common),
        Command::Export(args) => commands::export::run(&args, &cli.common),
        Command::Evaluate(args) => commands::evaluate::run(&args, &cli.common),
        Command::Reproduce(args) => commands::reproduce::run(&args, &cli.common),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            print_error_line(&format!("error: {}", causes(error.as_ref())));
            ExitCode::from(match error.downcast_ref() {
                Some(ReproduceError::Stopped(_)) => interrupt::INTERRUPTED,
                _ if is_own_failure(&error) => 1,
                _ => 2,
            })
        }
    }
}

/// Whether the program or the machine failed (a file that cannot be written, a step that went wrong), rather than the
/// input or the options being wrong.
fn is_own_failure(error: &anyhow::Error) -> bool {
    let unwritable = |io: &IoError| matches!(io, IoError::Write { .. });
    let of_training = |error: &TrainError| match error {
        TrainError::Io(io) | TrainError::Checkpoint(CheckpointError::Io(io)) => unwritable(io),
        TrainError::Prepare(PrepareError::Shape(error)) => error.is_own_failure(),
        TrainError::Step { .. } => true,
        _ => false,
    };
    error.downcast_ref().is_some_and(of_training)
        || error.downcast_ref().is_some_and(unwritable)
        || matches!(error.downcast_ref(), Some(ExportError::Io(io)) if unwritable(io))
        || matches!(error.downcast_ref(), Some(SynthError::Write(io)) if unwritable(io))
        || matches!(error.downcast_ref(), Some(SimulateError::Io(io)) if unwritable(io))
}
