//! The service with which a viewer asks a live flight for a fault, or to stand still.
//!
//! Must never decide about a request: the launcher of the run does, and answers.

use foxglove::{
    Schema,
    websocket::service::{Request, Service, ServiceSchema},
};
use ringwing_bus::{Answer, BusError};
use serde_json::{Value, json};
use std::sync::Arc;

/// The name of the service.
const NAME: &str = "/fault";
/// How requests and answers are encoded.
pub(super) const ENCODING: &str = "json";

/// Carries a request to a live flight, and its answer back.
pub(crate) type Ask = Arc<dyn Fn(&str) -> Result<Answer, BusError> + Send + Sync>;

/// The service that passes requests on to `ask`.
pub(super) fn service(ask: Ask) -> Service {
    let schema = ServiceSchema::new("ringwing.Fault")
        .with_request(ENCODING, of_text("ringwing.FaultRequest", "sentence", "A fault, such as: kill uav 3"))
        .with_response(ENCODING, of_text("ringwing.FaultResponse", "answer", "The tick at which it acts"));
    Service::builder(NAME, schema)
        // An answer comes when the fault acts. On a task of the server, that wait would hold up what all viewers get.
        .blocking_handler_fn(move |request: Request| answer(&ask, request.payload()))
}

/// The schema of an object with one text.
fn of_text(name: &str, key: &str, description: &str) -> Schema {
    let schema = json!({
        "type": "object",
        "properties": { key: { "type": "string", "description": description } },
        "required": [key],
    });
    Schema::new(name, "jsonschema", schema.to_string().into_bytes())
}

/// What a viewer gets for a request; the error is what it shows if the flight refuses.
fn answer(ask: &Ask, payload: &[u8]) -> Result<Vec<u8>, String> {
    let sentence = sentence(payload)?;
    let answer = ask(&sentence).map_err(|error| error.to_string())?;
    if answer.is_refusal() {
        return Err(answer.to_string());
    }
    Ok(json!({ "answer": answer.to_string() }).to_string().into_bytes())
}

/// The sentence in a request, which is one line: `{"sentence": "kill uav 3"}`, or the text alone.
fn sentence(payload: &[u8]) -> Result<String, String> {
    let request: Value = serde_json::from_slice(payload).map_err(|error| format!("not JSON: {error}"))?;
    let text = request.as_str().or_else(|| request["sentence"].as_str());
    let text = text.ok_or(r#"expected a sentence, such as {"sentence": "kill uav 3"}"#)?;
    match text.trim() {
        "" => Err("the sentence is empty".into()),
        // The launcher reads one line of a request, so it would drop the others in silence.
        text if text.contains('\n') => Err("the sentence has several lines".into()),
        text => Ok(text.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_holds_one_sentence() {
        assert_eq!(sentence(br#"{"sentence": " kill uav 3 "}"#), Ok("kill uav 3".into()));
        assert_eq!(sentence(br#""heal all""#), Ok("heal all".into()));
        for (payload, why) in [
            ("kill uav 3", "not JSON"),
            ("{}", "expected a sentence"),
            ("{\"sentence\": 3}", "expected a sentence"),
            ("\" \"", "empty"),
            (r#""kill uav 3\nkill uav 4""#, "several lines"),
        ] {
            assert!(sentence(payload.as_bytes()).unwrap_err().contains(why), "{payload}");
        }
    }
}
