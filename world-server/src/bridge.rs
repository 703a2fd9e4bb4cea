//! The connection of a run to the bridge of another world.

use std::io;
use std::sync::{Arc, Mutex};

use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader};
use tokio::net::unix::{OwnedReadHalf, OwnedWriteHalf};
use tokio::sync::watch;

use crate::external_bodies::{BodyCommands, inherited};
use crate::server::{Server, lock};

/// Connects a run to the bridge. The run ends if the bridge ends.
///
/// # Errors
/// If the standard input is no socket.
pub fn connect(server: &Arc<Mutex<Server>>) -> io::Result<()> {
    let (reader, writer) = inherited()?.into_split();
    let (sender, commands) = watch::channel(BodyCommands::default());
    lock(server).connect_bodies(sender);
    tokio::spawn(write(commands, writer));
    tokio::spawn(read(reader, Arc::clone(server)));
    Ok(())
}

/// Writes the newest commands. A bridge that does not read delays only this task. The socket is closed when the run is over.
async fn write(mut commands: watch::Receiver<BodyCommands>, mut writer: OwnedWriteHalf) {
    while commands.changed().await.is_ok() {
        let line = serde_json::to_string(&*commands.borrow_and_update());
        // Commands are finite numbers, so the encoding cannot fail.
        let line = line.unwrap_or_default() + "\n";
        if writer.write_all(line.as_bytes()).await.is_err() {
            return;
        }
    }
}

async fn read(reader: OwnedReadHalf, server: Arc<Mutex<Server>>) {
    let mut lines = BufReader::new(reader).lines();
    while let Ok(Some(line)) = lines.next_line().await {
        lock(&server).bridge_message(serde_json::from_str(&line));
    }
    lock(&server).lose_bodies();
}
