//! A headless Chromium, driven over its own protocol (CDP) through one web socket.

use crate::required::lacks;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::fs::File;
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tungstenite::{Message, WebSocket, client};

/// Names under which Chromium is looked for.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];
/// Without the background flags it looks up its maker's hosts; WebGL is drawn in software.
const FLAGS: [&str; 11] = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--remote-debugging-port=0",
];
/// Longest time for anything asked of it.
const PATIENCE: Duration = Duration::from_secs(60);

/// How long it has to end by itself: it takes its children and files with it then.
const FAREWELL: Duration = Duration::from_secs(5);

/// A program that ends with this value.
struct Running(Child);

impl Running {
    /// How it has ended, if it has.
    fn ended(&mut self) -> Option<ExitStatus> {
        self.0.try_wait().ok().flatten()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A browser with one page. It ends with this value.
pub struct Browser {
    process: Running,
    // Removed when the browser has ended: fields are dropped in this order.
    _profile: TempDir,
    socket: WebSocket<TcpStream>,
    session: Option<String>,
    next: u64,
    /// What the page complained of: errors and warnings of the console, uncaught exceptions, failed loads.
    pub complaints: Vec<String>,
    /// Addresses it asked for.
    pub requests: Vec<String>,
}

impl Browser {
    /// Starts Chromium; `None`, and a line that says so, where there is none. `more` flags are added.
    pub fn start(more: &[&str]) -> Option<Self> {
        let mut reason = "there is no Chromium to open reports in".to_owned();
        let begin = |name: &&str| launch(name, more)?.map_err(|why| reason = format!("{name} {why}")).ok();
        let Some((process, profile, socket)) = NAMES.iter().find_map(begin) else {
            lacks("BROWSER", &reason);
            return None;
        };
        let mut browser = Self {
            process,
            _profile: profile,
            socket,
            session: None,
            next: 0,
            complaints: Vec::new(),
            requests: Vec::new(),
        };
        let page = browser.ask("Target.createTarget", json!({ "url": "about:blank" }));
        let target = json!({ "targetId": page["targetId"], "flatten": true });
        let attached = browser.ask("Target.attachToTarget", target);
        browser.session = attached["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.ask(&format!("{domain}.enable"), json!({}));
        }
        Some(browser)
    }

    /// Sends a command and waits for its answer.
    pub fn ask(&mut self, method: &str, parameters: Value) -> Value {
        self.next += 1;
        let id = self.next;
        let mut message = json!({ "id": id, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        self.socket.send(Message::text(message.to_string())).expect("Chromium listens");
        loop {
            let answer = self.hear();
            if answer["id"] == id {
                assert!(answer["error"].is_null(), "{method}: {answer}");
                return answer["result"].clone();
            }
        }
    }

    /// The next message; events are noted on the way.
    fn hear(&mut self) -> Value {
        let message = self.socket.read().expect("Chromium answers");
        let value: Value = serde_json::from_str(message.to_text().unwrap_or("null")).unwrap_or_default();
        let event = &value["params"];
        match value["method"].as_str().unwrap_or("") {
            "Runtime.exceptionThrown" => self.complaints.push(event.to_string()),
            "Runtime.consoleAPICalled" if event["type"] == "error" || event["type"] == "warning" => {
                self.complaints.push(event["args"].to_string());
            }
            "Log.entryAdded" if event["entry"]["level"] == "error" => self.complaints.push(event.to_string()),
            "Network.requestWillBeSent" => {
                let address = event["request"]["url"].as_str().unwrap_or("");
                self.requests.push(address.chars().take(80).collect());
            }
            _ => {}
        }
        value
    }

    /// Opens a file and waits until it is loaded and drawn.
    pub fn open(&mut self, path: &Path) {
        let path = std::fs::canonicalize(path).expect("the page is there");
        self.ask("Page.navigate", json!({ "url": format!("file://{}", path.display()) }));
        let start = Instant::now();
        while self.run("document.readyState") != "complete" {
            assert!(start.elapsed() < PATIENCE, "the page does not load");
            std::thread::sleep(Duration::from_millis(50));
        }
        self.settle();
    }

    /// Waits until what was asked for is on the screen.
    pub fn settle(&mut self) {
        self.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(0))))");
    }

    /// The value of a JavaScript expression.
    pub fn run(&mut self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.ask("Runtime.evaluate", parameters);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {answer}");
        answer["result"]["value"].clone()
    }

    /// Presses and releases a key.
    pub fn press(&mut self, key: &str) {
        let code = match key {
            "Tab" => 9,
            "ArrowLeft" => 37,
            "ArrowUp" => 38,
            "ArrowRight" => 39,
            "ArrowDown" => 40,
            "Home" => 36,
            " " => 32,
            _ => 0,
        };
        let text = if key.len() == 1 { json!(key) } else { Value::Null };
        for kind in ["keyDown", "keyUp"] {
            let mut event = json!({ "type": kind, "key": key, "windowsVirtualKeyCode": code });
            if kind == "keyDown" && text.is_string() {
                event["text"] = text.clone();
            }
            self.ask("Input.dispatchKeyEvent", event);
        }
        self.settle();
    }

    /// Drags the pointer over the middle of an element.
    pub fn drag(&mut self, selector: &str, by: [f64; 2]) {
        let [x, y, width, height] = self.place(selector);
        let [x, y] = [x + width / 2.0, y + height / 2.0];
        let mut pointer = |kind: &str, x: f64, y: f64, buttons: u8| {
            let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1 });
            self.ask("Input.dispatchMouseEvent", event);
        };
        pointer("mousePressed", x, y, 1);
        pointer("mouseMoved", x + by[0], y + by[1], 1);
        pointer("mouseReleased", x + by[0], y + by[1], 0);
        self.settle();
    }

    /// Scrolls an element into view: left, top, width, height in the window.
    fn place(&mut self, selector: &str) -> [f64; 4] {
        let script = format!(
            "(() => {{ const e = document.querySelector('{selector}'); e.scrollIntoView({{ block: 'center' }}); \
             const r = e.getBoundingClientRect(); return [r.x, r.y, r.width, r.height]; }})()"
        );
        serde_json::from_value(self.run(&script)).expect("a rectangle")
    }

    /// A picture of an element, PNG.
    pub fn picture_of(&mut self, selector: &str) -> Vec<u8> {
        let [x, y, width, height] = self.place(selector);
        self.settle();
        // Clips count from the top of the page.
        let scrolled = self.run("window.scrollY").as_f64().unwrap_or(0.0);
        let clip = json!({ "x": x, "y": y + scrolled, "width": width, "height": height, "scale": 1 });
        self.shot(json!({ "format": "png", "clip": clip }))
    }

    /// A picture of the whole page, PNG.
    pub fn picture(&mut self) -> Vec<u8> {
        self.shot(json!({ "format": "png", "captureBeyondViewport": true }))
    }

    fn shot(&mut self, parameters: Value) -> Vec<u8> {
        let answer = self.ask("Page.captureScreenshot", parameters);
        STANDARD.decode(answer["data"].as_str().expect("a picture")).expect("base64")
    }

    /// The page on paper, PDF.
    pub fn print(&mut self) -> Vec<u8> {
        let answer =
            self.ask("Page.printToPDF", json!({ "printBackground": false, "preferCSSPageSize": true }));
        STANDARD.decode(answer["data"].as_str().expect("a PDF")).expect("base64")
    }

    /// Width and height of the window, and whether it is a phone's.
    pub fn resize(&mut self, width: u32, height: u32, phone: bool) {
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": phone });
        self.ask("Emulation.setDeviceMetricsOverride", metrics);
        self.settle();
    }

    /// Asks for a light or a dark page, or as on paper.
    pub fn prefer(&mut self, medium: &str, scheme: &str) {
        let features = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
        self.ask("Emulation.setEmulatedMedia", json!({ "media": medium, "features": features }));
        self.settle();
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let close = json!({ "id": self.next + 1, "method": "Browser.close" });
        let _ = self.socket.send(Message::text(close.to_string()));
        let start = Instant::now();
        while self.process.ended().is_none() && start.elapsed() < FAREWELL {
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

type Started = (Running, TempDir, WebSocket<TcpStream>);

/// Starts a browser in a profile of its own, which also takes its temporary files: why it has ended at once, or `None`
/// where there is none of this name.
fn launch(name: &str, more: &[&str]) -> Option<Result<Started, String>> {
    let profile = tempfile::tempdir().expect("a folder for the profile");
    let said = profile.path().join("stderr");
    let mut command = Command::new(name);
    command.args(FLAGS).args(more).arg(format!("--user-data-dir={}", profile.path().display()));
    command.arg("about:blank").env("TMPDIR", profile.path());
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(File::create(&said).expect("a file"));
    let mut process = Running(command.spawn().ok()?);
    Some(match connect(&mut process, profile.path()) {
        Ok(socket) => Ok((process, profile, socket)),
        Err(status) => {
            let said = std::fs::read_to_string(said).unwrap_or_default();
            Err(format!("ends at once, {status}: {}", said.trim()))
        }
    })
}

/// Chromium writes port and path of its socket into its profile, unless it ends.
fn connect(process: &mut Running, profile: &Path) -> Result<WebSocket<TcpStream>, ExitStatus> {
    let start = Instant::now();
    loop {
        if let Some(status) = process.ended() {
            return Err(status);
        }
        assert!(start.elapsed() < PATIENCE, "Chromium does not start");
        std::thread::sleep(Duration::from_millis(50));
        let text = std::fs::read_to_string(profile.join("DevToolsActivePort")).unwrap_or_default();
        let Some((port, path)) = text.trim().split_once('\n') else { continue };
        let Ok(stream) = TcpStream::connect(("127.0.0.1", port.parse().unwrap_or(0))) else { continue };
        stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
        let config =
            tungstenite::protocol::WebSocketConfig::default().max_message_size(None).max_frame_size(None);
        let address = format!("ws://127.0.0.1:{port}{path}");
        let (socket, _) = client::client_with_config(address, stream, Some(config)).expect("a web socket");
        return Ok(socket);
    }
}
