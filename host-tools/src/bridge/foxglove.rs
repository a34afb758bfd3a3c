//! Foxglove's WebSocket protocol, version 1: the server's side, topics of JSON.
//!
//! One thread listens, one serves each client. What a client has not taken in time is dropped and counted; one that takes
//! nothing for [`PATIENCE`] is let go.

use super::counts::Counts;
use crate::foxglove::Sink;
use anyhow::Context;
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::HashMap;
use std::io::ErrorKind;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tungstenite::http::HeaderValue;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message, WebSocket, accept_hdr_with_config};

const PROTOCOLS: [&str; 2] = ["foxglove.websocket.v1", "foxglove.sdk.v1"];
/// Messages that may wait for one client: some five seconds of everything.
const QUEUE: usize = 1024;
/// Clients at once.
const CLIENTS: usize = 8;
/// Longest message of a client, bytes: it only subscribes.
const LONGEST: usize = 65_536;
/// How long a client may take for a message.
const PATIENCE: Duration = Duration::from_secs(2);
/// How often a client's own messages are looked for.
const LOOK: Duration = Duration::from_millis(20);

/// A topic that was advertised.
#[derive(Clone)]
struct Channel {
    id: u16,
    topic: String,
    schema: String,
    json_schema: String,
}

impl Channel {
    fn advertisement(&self) -> Value {
        let Self { id, topic, schema, json_schema } = self;
        json!({
            "id": id, "topic": topic, "encoding": "json",
            "schemaName": schema, "schema": json_schema, "schemaEncoding": "jsonschema",
        })
    }
}

/// What goes to a client.
enum News {
    Channel(Channel),
    Data { channel: u16, time_ns: u64, json: Arc<[u8]>, arrived: Instant },
}

/// Topics and clients.
#[derive(Default)]
struct Hub {
    channels: Vec<Channel>,
    clients: Vec<SyncSender<News>>,
}

/// The server.
pub struct Server {
    hub: Arc<Mutex<Hub>>,
    /// Where it listens.
    pub at: SocketAddr,
    /// When the bytes arrived of which messages are made from here on.
    pub arrived: Instant,
    pub counts: Arc<Counts>,
}

/// A poisoned lock's data is whole: nothing panics while it is held.
fn lock(hub: &Mutex<Hub>) -> std::sync::MutexGuard<'_, Hub> {
    hub.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Server {
    /// Listens.
    pub fn open(at: SocketAddr) -> anyhow::Result<Self> {
        let listener = TcpListener::bind(at).with_context(|| format!("{at}: Foxglove cannot be served here"))?;
        let at = listener.local_addr()?;
        let (hub, counts) = (Arc::<Mutex<Hub>>::default(), Arc::<Counts>::default());
        let (theirs, counting) = (Arc::clone(&hub), Arc::clone(&counts));
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let (hub, counts) = (Arc::clone(&theirs), Arc::clone(&counting));
                std::thread::spawn(move || serve(stream, &hub, &counts));
            }
        });
        Ok(Self { hub, at, arrived: Instant::now(), counts })
    }
}

impl Sink for Server {
    fn channel(&mut self, topic: &str, schema: &str, json_schema: &[u8]) -> anyhow::Result<u16> {
        let mut hub = lock(&self.hub);
        let id = u16::try_from(hub.channels.len() + 1)?;
        let json_schema = String::from_utf8(json_schema.to_vec())?;
        let channel = Channel { id, topic: topic.to_owned(), schema: schema.to_owned(), json_schema };
        hub.channels.push(channel.clone());
        hub.clients.retain(|client| client.try_send(News::Channel(channel.clone())).is_ok());
        Ok(id)
    }

    fn message(&mut self, channel: u16, time_ns: u64, json: &[u8]) -> anyhow::Result<()> {
        let json: Arc<[u8]> = json.into();
        lock(&self.hub).clients.retain(|client| {
            let news = News::Data { channel, time_ns, json: Arc::clone(&json), arrived: self.arrived };
            match client.try_send(news) {
                Ok(()) => true,
                Err(TrySendError::Full(_)) => {
                    self.counts.note(None);
                    true
                }
                Err(TrySendError::Disconnected(_)) => false,
            }
        });
        Ok(())
    }
}

/// Chooses the protocol's name among those that the client offers.
#[expect(clippy::result_large_err, reason = "the library's own type")]
fn negotiate(request: &Request, mut response: Response) -> Result<Response, ErrorResponse> {
    let offered = request.headers().get_all("Sec-WebSocket-Protocol").iter().filter_map(|value| value.to_str().ok());
    let offered: Vec<&str> = offered.flat_map(|list| list.split(',')).map(str::trim).collect();
    match PROTOCOLS.into_iter().find(|name| offered.contains(name)) {
        Some(name) => {
            response.headers_mut().insert("Sec-WebSocket-Protocol", HeaderValue::from_static(name));
            Ok(response)
        }
        None => {
            let mut refusal = ErrorResponse::new(Some(format!("this server speaks {}", PROTOCOLS.join(", "))));
            *refusal.status_mut() = tungstenite::http::StatusCode::BAD_REQUEST;
            Err(refusal)
        }
    }
}

/// One client, until it goes.
fn serve(stream: TcpStream, hub: &Mutex<Hub>, counts: &Counts) {
    // A client that is gone, refused or slow ends here and nowhere else.
    let _ = (|| -> Result<(), tungstenite::Error> {
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        let limits = WebSocketConfig::default().max_message_size(Some(LONGEST)).max_frame_size(Some(LONGEST));
        let Ok(mut socket) = accept_hdr_with_config(stream, negotiate, Some(limits)) else {
            counts.refuse();
            return Ok(());
        };
        socket.get_mut().set_read_timeout(Some(LOOK))?;
        let info = json!({
            "op": "serverInfo", "name": concat!("backseat ", env!("CARGO_PKG_VERSION")),
            "capabilities": [], "supportedEncodings": ["json"], "metadata": {},
        });
        socket.send(Message::text(info.to_string()))?;
        let (sender, news) = sync_channel(QUEUE);
        let channels = {
            let mut hub = lock(hub);
            if hub.clients.len() >= CLIENTS {
                return Ok(());
            }
            hub.clients.push(sender);
            hub.channels.clone()
        };
        advertise(&mut socket, &channels)?;
        attend(&mut socket, &news, counts)
    })();
}

fn advertise(socket: &mut WebSocket<TcpStream>, channels: &[Channel]) -> Result<(), tungstenite::Error> {
    if channels.is_empty() {
        return Ok(());
    }
    let channels: Vec<Value> = channels.iter().map(Channel::advertisement).collect();
    socket.send(Message::text(json!({"op": "advertise", "channels": channels}).to_string()))
}

/// What a client may ask; anything else is passed over.
#[derive(Deserialize)]
#[serde(tag = "op", rename_all = "camelCase")]
enum Asked {
    Subscribe {
        subscriptions: Vec<Subscription>,
    },
    #[serde(rename_all = "camelCase")]
    Unsubscribe {
        subscription_ids: Vec<u32>,
    },
    #[serde(other)]
    Other,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Subscription {
    id: u32,
    channel_id: u16,
}

fn attend(socket: &mut WebSocket<TcpStream>, news: &Receiver<News>, counts: &Counts) -> Result<(), tungstenite::Error> {
    // a channel's subscription
    let mut subscribed: HashMap<u16, u32> = HashMap::new();
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => match serde_json::from_str(&text) {
                Ok(Asked::Subscribe { subscriptions }) => {
                    subscribed.extend(subscriptions.iter().map(|asked| (asked.channel_id, asked.id)));
                }
                Ok(Asked::Unsubscribe { subscription_ids }) => {
                    subscribed.retain(|_, id| !subscription_ids.contains(id));
                }
                Ok(Asked::Other) | Err(_) => counts.refuse(),
            },
            Ok(Message::Close(_)) => return Ok(()),
            Ok(_) => {}
            Err(tungstenite::Error::Io(error))
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            // longer than it may be, or no WebSocket's
            Err(error @ (tungstenite::Error::Capacity(_) | tungstenite::Error::Protocol(_))) => {
                counts.refuse();
                return Err(error);
            }
            Err(error) => return Err(error),
        }
        loop {
            match news.try_recv() {
                Err(TryRecvError::Empty) => break,
                // let go, for it did not keep up
                Err(TryRecvError::Disconnected) => return Ok(()),
                Ok(News::Channel(channel)) => advertise(socket, &[channel])?,
                Ok(News::Data { channel, time_ns, json, arrived }) => {
                    let Some(id) = subscribed.get(&channel) else { continue };
                    let mut data = Vec::with_capacity(13 + json.len());
                    data.push(1);
                    data.extend(id.to_le_bytes());
                    data.extend(time_ns.to_le_bytes());
                    data.extend_from_slice(&json);
                    let sent = socket.send(Message::binary(data));
                    counts.note(sent.is_ok().then_some(arrived));
                    sent?;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tungstenite::client::IntoClientRequest;

    #[test]
    fn a_client_gets_what_it_subscribes() {
        let mut server = Server::open("127.0.0.1:0".parse().unwrap()).unwrap();
        let url = format!("ws://{}", server.at);
        let mut wrong = url.clone().into_client_request().unwrap();
        wrong.headers_mut().insert("Sec-WebSocket-Protocol", HeaderValue::from_static("chat"));
        assert!(tungstenite::client(wrong, TcpStream::connect(server.at).unwrap()).is_err(), "another protocol");
        let before = server.channel("/before", "S", b"{\"type\":\"object\"}").unwrap();
        let mut request = url.into_client_request().unwrap();
        request.headers_mut().insert("Sec-WebSocket-Protocol", HeaderValue::from_static(PROTOCOLS[1]));
        let (mut client, _) = tungstenite::client(request, TcpStream::connect(server.at).unwrap()).unwrap();
        let json = |message: Message| -> Value { serde_json::from_str(message.to_text().unwrap()).unwrap() };
        assert_eq!(json(client.read().unwrap())["op"], "serverInfo");
        let advertised = json(client.read().unwrap());
        assert_eq!(advertised["channels"][0]["topic"], "/before");
        // topics that come later are advertised as well; nonsense is passed over
        let after = server.channel("/after", "S", b"{}").unwrap();
        assert_eq!(json(client.read().unwrap())["channels"][0]["id"], after);
        client.send(Message::text("{\"op\": \"nonsense\"}")).unwrap();
        client.send(Message::text("none at all")).unwrap();
        let asked = json!({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": after}]});
        client.send(Message::text(asked.to_string())).unwrap();
        // until the subscription has arrived
        while server.counts.read()[0] == 0 {
            server.message(before, 1, b"{}").unwrap();
            server.message(after, 0x0102, b"{\"x\":1}").unwrap();
            std::thread::sleep(LOOK);
        }
        let data = client.read().unwrap().into_data();
        assert_eq!(&data[..], [&[1, 7, 0, 0, 0, 2, 1, 0, 0, 0, 0, 0, 0][..], b"{\"x\":1}"].concat());
    }

    /// Bytes that are no WebSocket, a message that is none of the protocol's, one of a length that nobody has: each is
    /// counted, and the next client is served.
    #[test]
    fn who_lies_is_let_go_and_counted() {
        use std::io::Write;
        let server = Server::open("127.0.0.1:0".parse().unwrap()).unwrap();
        let refused = |count| {
            while server.counts.read()[2] < count {
                std::thread::sleep(LOOK);
            }
        };
        TcpStream::connect(server.at).unwrap().write_all(&[0xA5; 4096]).unwrap();
        refused(1);
        let open = || {
            let mut request = format!("ws://{}", server.at).into_client_request().unwrap();
            request.headers_mut().insert("Sec-WebSocket-Protocol", HeaderValue::from_static(PROTOCOLS[0]));
            tungstenite::client(request, TcpStream::connect(server.at).unwrap()).unwrap().0
        };
        let mut client = open();
        client.send(Message::text("{\"op\": \"nonsense\"}")).unwrap();
        refused(2);
        // a text of 2^62 bytes, masked
        client.get_mut().write_all(&[0x81, 0xFF, 0x40, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4]).unwrap();
        refused(3);
        assert!(open().read().unwrap().to_text().unwrap().contains("serverInfo"));
    }

    #[test]
    fn who_does_not_read_loses_messages_and_holds_nobody_up() {
        let mut server = Server::open("127.0.0.1:0".parse().unwrap()).unwrap();
        let (sender, _kept) = sync_channel(1);
        lock(&server.hub).clients.push(sender);
        for _ in 0..10 {
            server.message(1, 0, b"{}").unwrap();
        }
        assert_eq!(server.counts.read(), [0, 9, 0]);
    }
}
