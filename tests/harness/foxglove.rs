//! A client of Foxglove's WebSocket protocol, written from its specification, as other viewers are.

use base64::{Engine, engine::general_purpose::STANDARD};
use prost_reflect::{DescriptorPool, DynamicMessage};
use serde_json::{Value, json};
use std::{
    collections::BTreeMap,
    net::TcpStream,
    time::{Duration, Instant},
};
use tungstenite::{Message, WebSocket, client, client::IntoClientRequest, http::HeaderValue};

/// Longest wait for a message. Shorter fails tests on a busy machine; longer delays the report of a hang.
const LONGEST_WAIT: Duration = Duration::from_secs(60);

/// A viewer that is connected to a live server.
pub struct Viewer {
    socket: WebSocket<TcpStream>,
    /// What the server says about itself.
    pub info: Value,
    /// Its channels, by topic.
    pub channels: BTreeMap<String, Value>,
    /// Its services, by name.
    pub services: BTreeMap<String, Value>,
    calls: u32,
}

/// A message of a channel.
pub struct Received {
    /// Its topic.
    pub topic: String,
    /// Its log time, ns since 1970.
    pub log_time: u64,
    data: Vec<u8>,
}

/// What a server sends.
enum Incoming {
    Text(Value),
    Data(Received),
    /// The encoded answer of a service.
    Answer(Vec<u8>),
    /// How a log is played: status, time.
    Playback(u8, u64),
    Other,
}

/// The address in the line with which a server says where it is.
pub fn address_in(line: &str) -> String {
    let rest = line.split("ws://").nth(1).unwrap_or_else(|| panic!("no address in {line:?}"));
    let address: Vec<&str> = rest.split(':').take(2).collect();
    address.join(":")
}

impl Viewer {
    /// Connects to the server at `address` and takes in what it offers, at least a channel of `topic`.
    pub fn connect(address: &str, topic: &str) -> Self {
        let stream = TcpStream::connect(address).expect("the server listens");
        stream.set_read_timeout(Some(LONGEST_WAIT)).expect("a timeout");
        let mut request = format!("ws://{address}").into_client_request().expect("an address");
        let protocol = HeaderValue::from_static("foxglove.sdk.v1");
        request.headers_mut().insert("sec-websocket-protocol", protocol);
        let (socket, _) = client(request, stream).expect("the server speaks the protocol");
        let mut viewer = Self {
            socket,
            info: Value::Null,
            channels: BTreeMap::new(),
            services: BTreeMap::new(),
            calls: 0,
        };
        // A server may advertise its channels in several messages, so wait for the one that the test needs.
        while viewer.info.is_null() || !viewer.channels.contains_key(topic) {
            viewer.read();
        }
        viewer
    }

    /// The socket, for a viewer that does not read.
    pub fn into_socket(self) -> TcpStream {
        self.socket.into_inner()
    }

    /// Subscribes to `topics`. The number of a subscription is that of its channel.
    pub fn subscribe(&mut self, topics: &[&str]) {
        let subscriptions: Vec<Value> = topics
            .iter()
            .map(|topic| {
                let id = &self.channels[*topic]["id"];
                json!({ "id": id, "channelId": id })
            })
            .collect();
        self.send_text(&json!({ "op": "subscribe", "subscriptions": subscriptions }));
    }

    /// The next message of `topic`.
    pub fn next(&mut self, topic: &str) -> Received {
        loop {
            if let Incoming::Data(message) = self.read()
                && message.topic == topic
            {
                return message;
            }
        }
    }

    /// `message`, decoded by the schema that the server has sent.
    pub fn decode(&self, message: &Received) -> DynamicMessage {
        let channel = &self.channels[&message.topic];
        let schema = STANDARD.decode(channel["schema"].as_str().expect("a schema")).expect("base64");
        let pool = DescriptorPool::decode(schema.as_slice()).expect("a set of descriptors");
        let kind = pool.get_message_by_name(channel["schemaName"].as_str().expect("a name"));
        DynamicMessage::decode(kind.expect("the message's type"), message.data.as_slice()).expect("decodes")
    }

    /// The parameters with these `names`, by name.
    pub fn parameters(&mut self, names: &[&str]) -> BTreeMap<String, Value> {
        self.send_text(&json!({ "op": "getParameters", "parameterNames": names, "id": "1" }));
        loop {
            if let Incoming::Text(text) = self.read()
                && text["op"] == "parameterValues"
            {
                let found = text["parameters"].as_array().expect("parameters").iter();
                return found
                    .map(|one| (one["name"].as_str().expect("a name").to_owned(), one["value"].clone()))
                    .collect();
            }
        }
    }

    /// Calls the service `name`; the error is what the server says if it fails.
    pub fn call(&mut self, name: &str, request: &Value) -> Result<Value, String> {
        self.calls += 1;
        let service = self.services[name]["id"].as_u64().expect("a number") as u32;
        // 2 is a call of a service: its number, that of the call, then the length and the name of the request's
        // encoding.
        let mut bytes = vec![2];
        for number in [service, self.calls, 4] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(b"json");
        bytes.extend(request.to_string().bytes());
        self.send(Message::binary(bytes));
        loop {
            match self.read() {
                Incoming::Answer(data) => return Ok(serde_json::from_slice(&data).expect("JSON")),
                Incoming::Text(text) if text["op"] == "serviceCallFailure" => {
                    return Err(text["message"].as_str().expect("a reason").to_owned());
                }
                _ => {}
            }
        }
    }

    /// Asks for another way to play the log; returns the status and the time with which the server answers.
    pub fn control(&mut self, is_playing: bool, speed: f32, seek: Option<u64>) -> (u8, u64) {
        let mut bytes = vec![3, u8::from(!is_playing)];
        bytes.extend(speed.to_le_bytes());
        bytes.push(u8::from(seek.is_some()));
        bytes.extend(seek.unwrap_or(0).to_le_bytes());
        // The request ends with the length of its id and the id, which no test needs.
        bytes.extend(1_u32.to_le_bytes());
        bytes.push(b'x');
        self.send(Message::binary(bytes));
        self.playback()
    }

    /// The next status and time of a log that is played.
    pub fn playback(&mut self) -> (u8, u64) {
        loop {
            if let Incoming::Playback(status, time) = self.read() {
                return (status, time);
            }
        }
    }

    fn send_text(&mut self, text: &Value) {
        self.send(Message::text(text.to_string()));
    }

    fn send(&mut self, message: Message) {
        self.socket.send(message).expect("the server takes messages");
    }

    fn read(&mut self) -> Incoming {
        // The timeout of the socket begins anew with every message, so pings alone would keep a test waiting forever.
        let start = Instant::now();
        loop {
            assert!(start.elapsed() < LONGEST_WAIT, "the server sends nothing that is understood");
            match self.socket.read().expect("the server sends messages") {
                Message::Text(text) => return self.on_text(serde_json::from_str(&text).expect("JSON")),
                Message::Binary(bytes) => return self.on_bytes(&bytes),
                _ => {}
            }
        }
    }

    fn on_text(&mut self, text: Value) -> Incoming {
        let named = |list: &Value, key: &str| -> Vec<(String, Value)> {
            let all = list.as_array().expect("a list").iter();
            all.map(|one| (one[key].as_str().expect("a name").to_owned(), one.clone())).collect()
        };
        match text["op"].as_str() {
            Some("serverInfo") => self.info = text.clone(),
            Some("advertise") => self.channels.extend(named(&text["channels"], "topic")),
            Some("advertiseServices") => self.services.extend(named(&text["services"], "name")),
            _ => {}
        }
        Incoming::Text(text)
    }

    fn on_bytes(&self, bytes: &[u8]) -> Incoming {
        let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
        let u64_at = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"));
        match bytes[0] {
            // A message names its subscription, which has the number of the channel: see `subscribe`.
            1 => {
                let is_it = |channel: &&String| self.channels[*channel]["id"] == u32_at(1);
                let topic = self.channels.keys().find(is_it).expect("a channel that was subscribed to");
                Incoming::Data(Received {
                    topic: topic.clone(),
                    log_time: u64_at(5),
                    data: bytes[13..].to_owned(),
                })
            }
            // The answer comes after the name of its encoding, whose length is at byte 9.
            3 => Incoming::Answer(bytes[13 + u32_at(9) as usize..].to_owned()),
            5 => Incoming::Playback(bytes[1], u64_at(2)),
            _ => Incoming::Other,
        }
    }
}
