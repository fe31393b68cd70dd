//! Configurations of versions in which network and loss were settings beside the others: the paper's network only.

use super::TrainConfig;
use toml::{Table, Value};

/// Settings of the network then.
const NETWORK: [&str; 3] = ["blocks", "normalization", "activation"];
/// Settings of the loss then.
const LOSS: [&str; 3] = ["column-norm", "margin", "gamma"];

/// Whether a configuration is of such a version.
pub(super) fn is_earlier(table: &Table) -> bool {
    let flat = NETWORK.iter().chain(&LOSS).any(|name| table.contains_key(*name));
    flat || table.get("loss").is_some_and(Value::is_str)
}

/// The same settings as they are written now. What it leaves out has the defaults of then, the paper's.
pub(super) fn migrated(mut earlier: Table) -> Result<Table, String> {
    let mut table = Table::try_from(TrainConfig::paper()).map_err(|e| e.to_string())?;
    let soft = match earlier.remove("loss") {
        None => true,
        Some(Value::String(name)) if name == "soft" => true,
        Some(Value::String(name)) if name == "siamese" => false,
        Some(other) => return Err(format!("loss = {other}, but settings of an earlier version beside it")),
    };
    for (name, names) in [("network", &NETWORK), ("loss", &LOSS)] {
        let Some(Value::Table(inner)) = table.get_mut(name) else { continue };
        for name in names {
            if let Some(value) = earlier.remove(*name) {
                inner.insert(name.to_string(), value);
            }
        }
        if name == "loss" && !soft {
            inner.insert("soft-error".into(), Value::Float(0.0));
            inner.insert("siamese".into(), Value::Float(1.0));
        }
    }
    table.extend(earlier);
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::losses::LossOptions;
    use crate::network::{NetworkOptions, Normalization};

    #[test]
    fn settings_of_an_earlier_version_mean_what_they_meant() {
        let text = "k = 70\nloss = \"siamese\"\ngamma = 0.3\nblocks = 2\nnormalization = \"running\"\n";
        let config = TrainConfig::parse(text).unwrap();
        let NetworkOptions::Residual(network) = &config.network else { panic!("{:?}", config.network) };
        assert_eq!((network.blocks, network.normalization), (2, Normalization::Running));
        assert_eq!(config.loss, LossOptions { gamma: 0.3, ..LossOptions::siamese() });
        assert_eq!((config.k, config.points, config.clip), (70, 1000, 0.0));
        let error = TrainConfig::parse("blocks = 2\nlayers = 3").unwrap_err();
        assert!(error.contains("layers"), "{error}");
    }
}
