//! What each experiment consists of.

use super::{Experiment, Preparation, Settings, Test, TestMethod, Training, training_folder};
use crate::config::{List, Sampling, TrainConfig};
use crate::dataset::Split;
use crate::losses::LossOptions;
use fmnet::fmap::SolverKind;
use fmnet::pipeline::Refinement;
use std::path::Path;

/// Names of the experiments.
pub const NAMES: [&str; 5] =
    ["faust-synthetic", "faust-remeshed", "faust-scans", "scape-transfer", "partial-dog"];

/// The paper's minibatches for FAUST registrations, for scans and for SHREC'16.
const FAUST_STEPS: u64 = 20_000;
const SCAN_STEPS: u64 = 100_000;
const PARTIAL_STEPS: u64 = 1_000;
/// Eigenfunctions that a part determines better than the paper's 100.
const PARTIAL_K: usize = 70;

/// The experiment of a name, one of [`NAMES`]; `None` for others.
pub fn experiment(name: &str, settings: &Settings) -> Option<Experiment> {
    match name {
        "faust-synthetic" => Some(faust_synthetic(settings)),
        "faust-remeshed" => Some(faust_remeshed(settings)),
        "faust-scans" => Some(faust_scans(settings)),
        "scape-transfer" => Some(scape_transfer(settings)),
        "partial-dog" => Some(partial_dog(settings)),
        _ => None,
    }
}

fn faust_synthetic(settings: &Settings) -> Experiment {
    let registrations = settings.data.join("faust/registrations");
    let config = |name, solver, loss| TrainConfig {
        solver,
        loss,
        ..base(settings, name, &[&registrations], FAUST_STEPS)
    };
    let (regularized, plain, siamese) = ("faust-regularized", "faust-least-squares", "faust-siamese");
    Experiment {
        name: "faust-synthetic",
        text: "FAUST registrations, k = 120, same connectivity everywhere. The paper trains on subjects 0-7 and tests on 8-9; \
               here subjects 0-5 train and 6-7 test.",
        preparation: None,
        trainings: vec![
            training(regularized, config(regularized, SolverKind::Regularized, LossOptions::soft_error())),
            training(plain, config(plain, SolverKind::LeastSquares, LossOptions::soft_error())),
            training(siamese, config(siamese, SolverKind::LeastSquares, LossOptions::siamese())),
        ],
        test: Test {
            title: "FAUST registrations",
            dataset: registrations,
            splits: vec![Split::Validation],
            list: Some(settings.data.join("faust_validation_pairs.txt")),
            methods: vec![
                learned("regularised", regularized, 120, Refinement::None),
                learned("regularised + ZoomOut", regularized, 120, Refinement::Zoomout),
                learned("regularised + PMF", regularized, 120, Refinement::Pmf),
                learned(
                    "regularised + PMF, shared triangulation",
                    regularized,
                    120,
                    Refinement::SharedTriangulation,
                ),
                learned("FMNet", plain, 120, Refinement::None),
                learned("FMNet + PMF", plain, 120, Refinement::Pmf),
                learned("Siamese", siamese, 120, Refinement::None),
                shot(120),
            ],
            with_references: true,
        },
        gallery: None,
    }
}

fn faust_remeshed(settings: &Settings) -> Experiment {
    let remeshed = settings.data.join("faust/remeshed_5k");
    let name = "faust-remeshed";
    Experiment {
        name,
        text: "FAUST remeshed to 5000 vertices, each shape on its own: no shared connectivity. Subjects 0-5 train, 6-7 test. A \
               perfect vertex map scores 0.42.",
        preparation: None,
        trainings: vec![training(name, base(settings, name, &[&remeshed], FAUST_STEPS))],
        test: Test {
            title: "FAUST remeshed",
            dataset: remeshed,
            splits: vec![Split::Validation],
            list: Some(settings.data.join("faust_validation_pairs.txt")),
            methods: raw_zoomout_and_shot(name, 120),
            with_references: false,
        },
        gallery: None,
    }
}

fn faust_scans(settings: &Settings) -> Experiment {
    let scans = settings.out.join("data/scans");
    let name = "faust-scans";
    let config = TrainConfig {
        k: 70,
        sampling: Sampling::Area,
        jitter: 10,
        ..base(settings, name, &[&scans], SCAN_STEPS)
    };
    Experiment {
        name,
        text: "Scans, k = 70, points drawn by area and moved to one of the 10 nearest scan vertices. The training scans of the \
               paper are not public; here registrations are turned into scans with holes, noise, glued contacts and outlier \
               pieces, so that the ground truth is known. Errors in lengths are in the unit of the registrations. Real scans \
               without ground truth are pictured below.",
        preparation: Some(Preparation::Scans {
            from: settings.data.join("faust/registrations"),
            to: scans.clone(),
        }),
        trainings: vec![training(name, config)],
        test: Test {
            title: "Simulated scans",
            dataset: scans,
            splits: vec![Split::Validation],
            list: None,
            methods: raw_zoomout_and_shot(name, 70),
            with_references: false,
        },
        gallery: Some(settings.data.join("faust/scans_7k")),
    }
}

fn scape_transfer(settings: &Settings) -> Experiment {
    let faust = [settings.data.join("faust/registrations"), settings.data.join("faust/remeshed_5k")];
    let name = "faust";
    Experiment {
        name: "scape-transfer",
        text: "A network trained on FAUST, registrations and remeshed shapes, matches SCAPE, which it never saw.",
        preparation: None,
        trainings: vec![training(name, base(settings, name, &[&faust[0], &faust[1]], FAUST_STEPS))],
        test: Test {
            title: "SCAPE",
            dataset: settings.data.join("scape"),
            splits: vec![Split::Train, Split::Validation, Split::Test],
            list: None,
            methods: raw_zoomout_and_shot(name, 120),
            with_references: false,
        },
        gallery: None,
    }
}

fn partial_dog(settings: &Settings) -> Experiment {
    let parts = settings.out.join("data/dog-parts");
    let name = "dog-parts";
    let config = TrainConfig { k: 100, ..base(settings, name, &[&parts], PARTIAL_STEPS) };
    Experiment {
        name: "partial-dog",
        text: "Parts of the TOSCA dog in other poses, with holes or cut off, matched to the whole dog; k = 100 and 10 training \
               parts, as the paper has them on SHREC'16, and k = 70, which parts determine better. The official parts are \
               not public; these are cut in the same way, test parts from other poses and with other holes than training \
               parts.",
        preparation: Some(Preparation::Parts { from: settings.data.join("tosca/dog"), to: parts.clone() }),
        trainings: vec![training(name, config)],
        test: Test {
            title: "Parts of the dog",
            dataset: parts,
            splits: vec![Split::Test],
            list: None,
            methods: vec![
                learned("FMNet", name, 100, Refinement::None),
                learned("FMNet + ZoomOut", name, 100, Refinement::Zoomout),
                learned("FMNet, k = 70", name, PARTIAL_K, Refinement::None),
                learned("FMNet, k = 70 + ZoomOut", name, PARTIAL_K, Refinement::Zoomout),
                shot(100),
            ],
            with_references: false,
        },
        gallery: None,
    }
}

/// The network of a training.
fn learned(label: &'static str, training: &'static str, k: usize, refinement: Refinement) -> TestMethod {
    TestMethod { label, training: Some(training), k, refinement }
}

/// The paper's baseline.
fn shot(k: usize) -> TestMethod {
    TestMethod { label: "SHOT", training: None, k, refinement: Refinement::None }
}

fn raw_zoomout_and_shot(training: &'static str, k: usize) -> Vec<TestMethod> {
    vec![
        learned("FMNet", training, k, Refinement::None),
        learned("FMNet + ZoomOut", training, k, Refinement::Zoomout),
        shot(k),
    ]
}

fn training(name: &'static str, config: TrainConfig) -> Training {
    Training { name, config }
}

/// Settings that all trainings share.
fn base(settings: &Settings, name: &str, datasets: &[&Path], paper_steps: u64) -> TrainConfig {
    let steps = settings.steps.unwrap_or(paper_steps);
    TrainConfig {
        dataset: List(datasets.iter().map(|folder| folder.display().to_string()).collect()),
        out: training_folder(&settings.out, name),
        cache: settings.out.join("cache"),
        steps,
        pool: 2000,
        validate_every: (steps / 8).max(1),
        validation_pairs: 20,
        ..TrainConfig::paper()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    #[test]
    fn every_name_is_an_experiment_that_tests_what_it_trains() {
        let settings = Settings {
            data: PathBuf::from("data"),
            out: PathBuf::from("out"),
            steps: Some(7),
            pairs: 10,
            curves: None,
        };
        for name in NAMES {
            let experiment = experiment(name, &settings).unwrap();
            assert_eq!(experiment.name, name);
            assert!(!experiment.text.is_empty());
            for training in &experiment.trainings {
                training.config.check().unwrap();
                assert_eq!(training.config.steps, 7);
            }
            let trained: Vec<&str> = experiment.trainings.iter().map(|t| t.name).collect();
            let tested = experiment.test.methods.iter().filter_map(|m| m.training);
            assert!(
                tested.clone().count() > 0 && tested.clone().all(|name| trained.contains(&name)),
                "{name}"
            );
        }
        assert_eq!(experiment("unknown", &settings), None);
    }
}
