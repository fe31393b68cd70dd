//! `fmnet-train train`.

use crate::args::{Common, TrainArgs};
use crate::interrupt;
use crate::progress::{Progress, print_summary, shown};
use anyhow::{Context, Result, bail};
use candle_core::Device;
use fmnet_trainer::config::TrainConfig;
use fmnet_trainer::train::train;
use serde_json::json;

pub(crate) fn run(args: TrainArgs, common: &Common) -> Result<()> {
    let mut config = match &args.config {
        Some(path) => TrainConfig::read(path)?,
        None => TrainConfig::default(),
    };
    args.overrides.apply(&mut config)?;
    let device = device(args.cuda)?;
    let progress = Progress::new(common);
    let summary = train(&config, &device, &|event| progress.event(event), interrupt::stop())?;
    let out = config.out.display();
    if summary.stopped {
        progress
            .say(&format!("stopped after minibatch {}; the same command goes on from there", summary.step));
    } else {
        progress.say(&format!("done; write the model with: fmnet-train export {out} -o model.onnx"));
    }
    if common.json {
        let best = summary.best_error.is_finite().then_some(summary.best_error);
        print_summary(
            &json!({ "out": shown(&config.out), "step": summary.step, "stopped": summary.stopped, "best_error": best }),
        )?;
    }
    Ok(())
}

/// The first GPU, or the CPU.
pub(super) fn device(cuda: bool) -> Result<Device> {
    match cuda {
        true if cfg!(not(feature = "cuda")) => {
            bail!("this program was built without the feature `cuda`; see trainer/build-cuda.sh, or leave --cuda out")
        }
        true => Device::new_cuda(0).context(
            "no NVIDIA GPU can be used; check the driver with nvidia-smi, or leave --cuda out to train on the CPU",
        ),
        false => Ok(Device::Cpu),
    }
}
