//! The scenario of a flight as the parameters of a live server, to read: `formation.uavs`, `control.law`, ...
//!
//! Must never change a scenario: a flight keeps its own.

use foxglove::websocket::{
    AnyClient, GetParametersResponder, Parameter, ParameterHandler, SetParametersResponder,
};
use ringwing_recorder::flat::flattened;
use ringwing_scenario::Scenario;
use serde_json::Value;

/// The parameters of one flight.
pub(crate) struct ScenarioParameters(Vec<Parameter>);

impl ScenarioParameters {
    /// The parameters of a flight of `scenario`, each under the path of its key.
    pub(crate) fn of(scenario: &Scenario) -> Self {
        let leaves = flattened(&serde_json::to_value(scenario).unwrap_or_default());
        Self(leaves.into_iter().map(|(path, value)| parameter(path, &value)).collect())
    }

    /// Those with these `names`, or all.
    fn named(&self, names: &[String]) -> Vec<Parameter> {
        // In Foxglove's protocol, a request without names asks for all parameters.
        let is_wanted = |parameter: &&Parameter| names.is_empty() || names.contains(&parameter.name);
        self.0.iter().filter(is_wanted).cloned().collect()
    }
}

impl ParameterHandler for ScenarioParameters {
    fn get(&self, _: AnyClient, names: Vec<String>, _: Option<String>, responder: GetParametersResponder) {
        responder.respond(self.named(&names));
    }

    fn set(
        &self,
        _: AnyClient,
        wanted: Vec<Parameter>,
        _: Option<String>,
        responder: SetParametersResponder,
    ) {
        // The answer holds the values that are flown, so that a viewer shows these and not what was typed.
        let names: Vec<String> = wanted.into_iter().map(|parameter| parameter.name).collect();
        responder.respond(self.named(&names));
    }
}

fn parameter(path: String, value: &Value) -> Parameter {
    match value {
        Value::Bool(is_on) => Parameter::bool(path, *is_on),
        // A key of a float stays a float even if its value is whole: `as_i64` reads no number that came from a float.
        Value::Number(number) => match number.as_i64() {
            Some(whole) => Parameter::integer(path, whole),
            None => Parameter::float64(path, number.as_f64().unwrap_or_default()),
        },
        Value::String(text) => Parameter::string(path, text),
        // `flattened` leaves neither lists nor tables nor nulls, so this arm only completes the match.
        other => Parameter::string(path, other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use foxglove::websocket::ParameterValue;

    #[test]
    fn every_key_of_the_scenario_is_a_parameter() {
        let mut scenario = Scenario::default();
        scenario.formation.uavs = 7;
        let parameters = ScenarioParameters::of(&scenario);
        let [uavs] = parameters.named(&["formation.uavs".into()]).try_into().unwrap();
        assert_eq!(uavs.value, Some(ParameterValue::Integer(7)));
        let [law] = parameters.named(&["control.law".into()]).try_into().unwrap();
        assert_eq!(law.value, Some(ParameterValue::String("paper".into())));
        assert!(parameters.named(&[]).len() > 50 && parameters.named(&["nothing".into()]).is_empty());
    }
}
