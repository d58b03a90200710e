//! Energies by their names and weights.

use std::str::FromStr;

use faircurve::discrete::Energy;

/// Weights of energies, such as bending=1,length=0.1.
#[derive(Clone, Debug)]
pub struct EnergyWeights(Vec<(String, f64)>);

impl FromStr for EnergyWeights {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        weights(text, Energy::NAMES).map(EnergyWeights)
    }
}

pub fn energy_help() -> String {
    format!(
        "What is minimised: a weighted sum of {}. Weights are in units of the input; the weight of tautness has none if bending is \
         given, too. With attachment points are no longer fixed [default: bending=1,tautness=1; with --exponent bending=1]",
        Energy::NAMES.join(", ")
    )
}

/// Reads weights of some of the energies named, such as bending=1,length=0.1.
pub fn weights(text: &str, energies: &[&str]) -> Result<Vec<(String, f64)>, String> {
    let mut weights: Vec<(String, f64)> = Vec::new();
    for part in text.split(',') {
        let known = energies.join(", ");
        let (name, weight) = part.split_once('=').ok_or_else(|| format!("'{part}' is not NAME=WEIGHT"))?;
        let (name, weight) = (name.trim(), weight.trim());
        if !energies.contains(&name) {
            return Err(format!("there is no energy '{name}': use {known}"));
        }
        if weights.iter().any(|(other, _)| other == name) {
            return Err(format!("{name} stands twice: give it one weight"));
        }
        let number: f64 = weight.parse().map_err(|_| format!("the weight of {name} is '{weight}', not a number"))?;
        if !(number >= 0.0 && number.is_finite()) {
            return Err(format!("the weight of {name} is {weight}; weights are 0 or positive numbers"));
        }
        weights.push((name.to_string(), number));
    }
    Ok(weights)
}

impl EnergyWeights {
    pub fn energy(&self, exponent: f64) -> Energy {
        let weighted = self
            .0
            .iter()
            .filter(|(_, weight)| *weight > 0.0)
            .map(|(name, weight)| *weight * Energy::named(name).expect("names were checked on reading"));
        weighted.fold(Energy::default(), |sum, energy| sum + energy).with_exponent(exponent)
    }

    pub fn has(&self, name: &str) -> bool {
        self.0.iter().any(|(other, weight)| other == name && *weight > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_for_an_energy_means_that_energy() {
        for name in Energy::NAMES {
            let weights: EnergyWeights = format!("{name}=2").parse().unwrap();
            assert_eq!(weights.energy(2.0).to_string(), format!("2 {name}"));
        }
    }
}
