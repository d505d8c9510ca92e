//! Which part of a sweep one job of a cluster flies.
//!
//! The number of a flight alone decides its shard, so jobs need no coordinator.

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// A part of a sweep: shard `number` of `count`, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Shard {
    /// Its number, from 1.
    pub number: u64,
    /// How many there are.
    pub count: u64,
}

impl Shard {
    /// The whole sweep.
    pub const WHOLE: Self = Self { number: 1, count: 1 };

    /// Whether the flight, or the cell, with this number belongs to the shard.
    pub fn has(self, number: u64) -> bool {
        number % self.count == self.number - 1
    }

    /// The shard that a cluster's job is, by its environment: Slurm's job array, or an indexed Job of Kubernetes.
    ///
    /// # Errors
    /// A variable is missing or is not a number; the message says which.
    pub fn of_environment(variable: impl Fn(&str) -> Option<String>) -> Result<Option<Self>, String> {
        if let Some(id) = variable("SLURM_ARRAY_TASK_ID") {
            let id = number("SLURM_ARRAY_TASK_ID", &id)?;
            let count = required(&variable, "SLURM_ARRAY_TASK_COUNT")?;
            // Arrays may begin with any number and may have gaps of equal size: --array=1-16, --array=0-30:2.
            let first = variable("SLURM_ARRAY_TASK_MIN")
                .map_or(Ok(0), |text| number("SLURM_ARRAY_TASK_MIN", &text))?;
            let step = variable("SLURM_ARRAY_TASK_STEP")
                .map_or(Ok(1), |text| number("SLURM_ARRAY_TASK_STEP", &text))?;
            return Self::at((id.saturating_sub(first)) / step.max(1), count).map(Some);
        }
        if let Some(index) = variable("JOB_COMPLETION_INDEX") {
            let index = number("JOB_COMPLETION_INDEX", &index)?;
            return Self::at(index, required(&variable, "JOB_COMPLETION_COUNT")?).map(Some);
        }
        Ok(None)
    }

    /// The shard with this index, from 0.
    fn at(index: u64, count: u64) -> Result<Self, String> {
        if index < count {
            Ok(Self { number: index + 1, count })
        } else {
            Err(format!(
                "shard {} of {count} does not exist: give one with --shard, such as --shard 1/{count}",
                index + 1
            ))
        }
    }
}

fn required(variable: &impl Fn(&str) -> Option<String>, name: &str) -> Result<u64, String> {
    let text = variable(name).ok_or_else(|| {
        format!("{name} is not set, so the number of shards is unknown: set it, or give --shard 1/16")
    })?;
    number(name, &text)
}

fn number(name: &str, text: &str) -> Result<u64, String> {
    text.trim()
        .parse()
        .map_err(|_| format!("{name}={text:?} is not a whole number: set it, or give --shard 1/16"))
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let shard = text.split_once('/').and_then(|(number, count)| {
            let (number, count) = (number.trim().parse().ok()?, count.trim().parse().ok()?);
            (1..=count).contains(&number).then_some(Self { number, count })
        });
        shard.ok_or_else(|| {
            format!("{text:?} is not a shard: give its number and how many there are, such as 3/16")
        })
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn environment(variables: &[(&str, &str)]) -> Result<Option<Shard>, String> {
        Shard::of_environment(|name| {
            variables.iter().find(|(variable, _)| *variable == name).map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn a_shard_is_given_as_a_fraction() {
        assert_eq!("3/16".parse(), Ok(Shard { number: 3, count: 16 }));
        for text in ["0/16", "17/16", "3", "a/b", "3/0", "-1/4"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }

    #[test]
    fn a_job_array_of_slurm_and_an_indexed_job_of_kubernetes_say_which_shard_they_are() {
        let third = Ok(Some(Shard { number: 3, count: 16 }));
        assert_eq!(environment(&[("SLURM_ARRAY_TASK_ID", "2"), ("SLURM_ARRAY_TASK_COUNT", "16")]), third);
        let from_one =
            [("SLURM_ARRAY_TASK_ID", "3"), ("SLURM_ARRAY_TASK_COUNT", "16"), ("SLURM_ARRAY_TASK_MIN", "1")];
        assert_eq!(environment(&from_one), third);
        assert_eq!(environment(&[("JOB_COMPLETION_INDEX", "2"), ("JOB_COMPLETION_COUNT", "16")]), third);
        assert_eq!(environment(&[]), Ok(None));
    }

    #[test]
    fn a_job_that_does_not_know_its_shard_is_refused() {
        assert!(
            environment(&[("JOB_COMPLETION_INDEX", "2")])
                .unwrap_err()
                .contains("JOB_COMPLETION_COUNT is not set")
        );
        assert!(environment(&[("SLURM_ARRAY_TASK_ID", "x"), ("SLURM_ARRAY_TASK_COUNT", "4")]).is_err());
        assert!(environment(&[("SLURM_ARRAY_TASK_ID", "4"), ("SLURM_ARRAY_TASK_COUNT", "4")]).is_err());
    }
}
