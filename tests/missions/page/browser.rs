//! A real browser, controlled like by a user: headless Chromium with its WebDriver.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use alliance_tests::harness::wait_until;
use alliance_tests::needs::cannot_run;
use fantoccini::actions::{
    InputSource, KeyAction, KeyActions, MOUSE_BUTTON_LEFT, MouseActions, PointerAction,
};
use fantoccini::{Client, ClientBuilder, Locator};
use hyper_util::client::legacy::connect::HttpConnector;
use serde_json::{Value, json};
use tempfile::TempDir;
use tokio::runtime::Runtime;

/// The window size of a laptop.
pub const LAPTOP: (u32, u32) = (1280, 800);

/// The window size of a large screen.
pub const DESKTOP: (u32, u32) = (1920, 1080);

/// The window size of an upright phone.
pub const PHONE: (u32, u32) = (390, 844);

/// The window size of a sideways phone.
pub const LANDSCAPE: (u32, u32) = (844, 390);

/// The keys of a shortcut.
pub const CONTROL: char = '\u{e009}';
pub const SHIFT: char = '\u{e008}';

const OPTIONS: [&str; 10] = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-logging=stderr",
];

/// A browser with one window. It ends when dropped.
pub struct Browser {
    runtime: Runtime,
    client: Client,
    driver: Child,
    /// The output of driver and browser, including the console messages of the pages.
    log: PathBuf,
    folder: TempDir,
}

impl Browser {
    /// Starts a browser with this page size. Returns `None` without a browser, if the test may be skipped.
    pub fn start(size: (u32, u32)) -> Option<Self> {
        Self::start_with(size, &[])
    }

    /// Starts a browser whose user prefers dark pages. See [`Browser::start`].
    pub fn start_dark(size: (u32, u32)) -> Option<Self> {
        Self::start_with(size, &["--blink-settings=preferredColorScheme=0"])
    }

    /// Starts a browser like one before WebAssembly. See [`Browser::start`].
    pub fn start_without_webassembly(size: (u32, u32)) -> Option<Self> {
        Self::start_with(size, &["--js-flags=--jitless"])
    }

    fn start_with((width, height): (u32, u32), more: &[&str]) -> Option<Self> {
        let folder = TempDir::new().unwrap();
        let log = folder.path().join("driver.log");
        let output = File::create(&log).unwrap();
        let started = Command::new("chromedriver")
            .args(["--port=0", "--enable-chrome-logs"])
            .stdin(Stdio::null())
            .stdout(output.try_clone().unwrap())
            .stderr(output)
            .spawn();
        let Ok(driver) = started else {
            let how = "no browser: run `.ci/run`, or install Debian's packages chromium and chromium-driver";
            cannot_run(how);
            return None;
        };
        let mut port = None;
        wait_until("the browser's driver", || {
            let text = std::fs::read_to_string(&log).unwrap_or_default();
            port = text.lines().find_map(|line| {
                let number = line.split("successfully on port ").nth(1)?;
                number.trim_end_matches('.').parse::<u16>().ok()
            });
            port.is_some()
        });
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .unwrap();
        let profile = folder.path().join("profile");
        let profile = format!("--user-data-dir={}", profile.display());
        let options = json!({
            "args": ([&OPTIONS[..], more, &[profile.as_str()]].concat()),
            "prefs": {"download.default_directory": folder.path()},
            "mobileEmulation": {
                "deviceMetrics": {
                    "width": width, "height": height, "pixelRatio": 1.0,
                    "touch": width < 900, "mobile": width < 900,
                },
            },
        });
        let mut capabilities = serde_json::Map::new();
        capabilities.insert("goog:chromeOptions".to_owned(), options);
        let client = runtime.block_on(async {
            let url = format!("http://127.0.0.1:{}", port.unwrap());
            let mut builder = ClientBuilder::new(HttpConnector::new());
            builder.capabilities(capabilities).connect(&url).await
        });
        let client = client.unwrap_or_else(|error| {
            let text = std::fs::read_to_string(&log).unwrap_or_default();
            panic!("the browser does not start: {error}\n{text}")
        });
        Some(Self {
            runtime,
            client,
            driver,
            log,
            folder,
        })
    }

    pub fn open(&self, url: &str) {
        self.runtime.block_on(self.client.goto(url)).unwrap();
    }

    /// Returns the value of an expression on the page.
    #[track_caller]
    pub fn eval(&self, expression: &str) -> Value {
        let script = format!("return ({expression});");
        let evaluated = self.runtime.block_on(self.client.execute(&script, vec![]));
        evaluated.unwrap_or_else(|error| panic!("{expression}: {error}"))
    }

    /// Runs axe-core on the page in its present state. `axe` is the source of axe-core. Returns a line for each violated
    /// rule, with its elements and the remedy.
    #[track_caller]
    pub fn accessibility_violations(&self, axe: &str) -> Vec<String> {
        const SCRIPT: &str = "
            const done = arguments[arguments.length - 1];
            const line = ({ id, impact, help, nodes }) => {
                const places = nodes.slice(0, 3).map((node) => `${node.target.join(' ')} (${node.failureSummary})`);
                const more = nodes.length > 3 ? ` and ${nodes.length - 3} more elements` : '';
                return `${id}, ${impact}: ${help}: ${places.join(', ')}${more}`.replaceAll(/\\s+/g, ' ');
            };
            axe.run().then(({ violations }) => done(violations.map(line)), (error) => done([`axe-core failed: ${error}`]));
        ";
        let found = self.runtime.block_on(async {
            self.client.execute(axe, vec![]).await?;
            self.client.execute_async(SCRIPT, vec![]).await
        });
        let found = found.unwrap_or_else(|error| panic!("axe-core: {error}"));
        let lines = found.as_array().unwrap().iter();
        lines
            .map(|line| line.as_str().unwrap().to_owned())
            .collect()
    }

    /// Sets the value of an input field, as JavaScript, like a user.
    #[track_caller]
    pub fn input(&self, selector: &str, value: &str) {
        self.eval(&format!(
            "(() => {{ const field = document.querySelector({selector:?}); field.value = {value}; field.dispatchEvent(new Event('input', {{bubbles: true}})); return true; }})()"
        ));
    }

    /// Checks that no page has written to the console.
    #[track_caller]
    pub fn assert_no_console_message(&self) {
        assert_eq!(self.console(), Vec::<String>::new());
    }

    /// Waits until an expression is neither null nor false, and returns it.
    #[track_caller]
    pub fn wait_for(&self, expression: &str) -> Value {
        let mut found = Value::Null;
        wait_until(expression, || {
            found = self.eval(expression);
            !matches!(found, Value::Null | Value::Bool(false))
        });
        found
    }

    /// Returns the visible text of the first matching element.
    #[track_caller]
    pub fn text(&self, selector: &str) -> String {
        let element = self.wait_for(&format!(
            "document.querySelector({selector:?})?.innerText ?? null"
        ));
        element.as_str().unwrap().to_owned()
    }

    /// Clicks on the first matching element.
    #[track_caller]
    pub fn click(&self, selector: &str) {
        self.runtime.block_on(async {
            let wait = self.client.wait().at_most(Duration::from_secs(60));
            let element = wait.for_element(Locator::Css(selector)).await;
            let element = element.unwrap_or_else(|error| panic!("{selector}: {error}"));
            let clicked = element.click().await;
            clicked.unwrap_or_else(|error| panic!("{selector}: {error}"));
        });
    }

    #[track_caller]
    pub fn choose(&self, selector: &str, value: &str) {
        self.runtime.block_on(async {
            let found = self.client.find(Locator::Css(selector)).await;
            let element = found.unwrap_or_else(|error| panic!("{selector}: {error}"));
            element.select_by_value(value).await.unwrap();
        });
    }

    /// Drags the mouse between two points, in pixels of the window.
    pub fn drag(&self, from: (i64, i64), to: (i64, i64)) {
        let at = |(x, y): (i64, i64)| PointerAction::MoveTo {
            duration: Some(Duration::from_millis(50)),
            x: x as f64,
            y: y as f64,
        };
        let button = MOUSE_BUTTON_LEFT;
        let between = ((from.0 + to.0) / 2, (from.1 + to.1) / 2);
        let mouse = MouseActions::new("mouse".to_owned())
            .then(at(from))
            .then(PointerAction::Down { button })
            .then(at(between))
            .then(at(to))
            .then(PointerAction::Up { button });
        let performed = self.client.perform_actions(mouse);
        self.runtime.block_on(performed).unwrap();
    }

    pub fn press(&self, key: char) {
        let keys = KeyActions::new("keyboard".to_owned())
            .then(KeyAction::Down { value: key })
            .then(KeyAction::Up { value: key });
        let performed = self.client.perform_actions(keys);
        self.runtime.block_on(performed).unwrap();
    }

    /// Moves the focus to the first matching element. Waits until it is visible.
    #[track_caller]
    pub fn focus(&self, selector: &str) {
        self.wait_for(&format!(
            "(() => {{ const found = document.querySelector({selector:?}); found?.focus(); return found && document.activeElement == found; }})()"
        ));
    }

    /// Presses a key while others are held.
    pub fn press_with(&self, held: &[char], key: char) {
        let keys = KeyActions::new("keyboard".to_owned());
        let down = |keys: KeyActions, key: &char| keys.then(KeyAction::Down { value: *key });
        let up = |keys: KeyActions, key: &char| keys.then(KeyAction::Up { value: *key });
        let keys = up(down(held.iter().fold(keys, down), &key), &key);
        let keys = held.iter().fold(keys, up);
        let performed = self.client.perform_actions(keys);
        self.runtime.block_on(performed).unwrap();
    }

    /// Chooses a file of this computer in a field.
    #[track_caller]
    pub fn choose_file(&self, selector: &str, path: &Path) {
        self.runtime.block_on(async {
            let found = self.client.find(Locator::Css(selector)).await;
            let element = found.unwrap_or_else(|error| panic!("{selector}: {error}"));
            element.send_keys(path.to_str().unwrap()).await.unwrap();
        });
    }

    /// Returns the folder of downloaded files.
    pub fn downloads(&self) -> &Path {
        self.folder.path()
    }

    /// Saves a picture of the window in the build's folder for temporary files.
    pub fn screenshot(&self, name: &str) {
        let png = self.runtime.block_on(self.client.screenshot()).unwrap();
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
        std::fs::write(folder.join(format!("{name}.png")), png).unwrap();
    }

    fn console(&self) -> Vec<String> {
        let text = std::fs::read_to_string(&self.log).unwrap_or_default();
        text.lines()
            .filter(|line| line.contains("CONSOLE"))
            .map(ToOwned::to_owned)
            .collect()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // The browser is a child of the driver, so it closes first.
        let _ = self.runtime.block_on(self.client.clone().close());
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}
