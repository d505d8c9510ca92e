//! Which UAVs and commands `[[agents]]` may name.

use super::violation::Violation;
use crate::{AgentSection, Scenario, model::NamedUavs};

pub(super) fn agents(scenario: &Scenario) -> Vec<Violation> {
    let sections = scenario.agents.iter().enumerate();
    sections
        .flat_map(|(index, section)| {
            uavs(scenario, index, section).into_iter().chain(command(index, section))
        })
        .collect()
}

fn uavs(scenario: &Scenario, index: usize, section: &AgentSection) -> Option<Violation> {
    let (key, count) = (format!("agents.{index}.uavs"), scenario.formation.uavs);
    let Some(named) = section.named() else {
        let remedy = "write \"all\", or numbers such as \"3\" or \"1, 4\"";
        return Some(Violation::at(key, format!("{:?} names no UAVs: {remedy}", section.uavs)));
    };
    let NamedUavs::Numbers(numbers) = named else { return None };
    let wrong = numbers.into_iter().find(|uav| !(1..=count).contains(uav))?;
    let message = format!("there is no UAV {wrong}: this swarm has UAVs 1 to {count}");
    Some(Violation::at(key, message).depending_on("formation.uavs"))
}

fn command(index: usize, section: &AgentSection) -> Option<Violation> {
    let message = if section.command.first().is_none_or(String::is_empty) {
        "there is no program: write its name and its arguments, such as [\"python3\", \"mine.py\"]"
    } else if section.command.iter().any(|word| word.contains('\0')) {
        "no program can be given a zero byte: remove it"
    } else {
        return None;
    };
    Some(Violation::at(format!("agents.{index}.command"), message))
}
