//! A copy of a recording for a running rerun viewer.
//!
//! Neither the run nor the file ever waits for it: a viewer that takes nothing loses what
//! does not fit into a buffer.

use std::{
    net::{TcpStream, ToSocketAddrs},
    thread,
    time::Duration,
};

use crossbeam_channel::{Receiver, Sender, bounded};
use rerun::{
    external::re_uri::ProxyUri,
    log::LogMsg,
    sink::{GrpcSink, LogSink, SinkFlushError},
};

use thiserror::Error;

use super::file::RecordingFile;

/// Address at which a viewer listens.
pub const VIEWER: &str = "rerun+http://127.0.0.1:9876/proxy";

/// Maximum wait for a viewer, at the start and at the end of a recording.
const PATIENCE: Duration = Duration::from_secs(2);

/// Messages that may wait for the viewer: about a minute of a run in real time.
const BACKLOG: usize = 2_048;

/// Why no viewer was found at an address.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ViewerError {
    /// The text is not an address.
    #[error("{0:?} is not the address of a viewer, such as {VIEWER}")]
    NoAddress(String),
    /// Nobody listens there.
    #[error("no viewer listens at {0}: start one with the command rerun")]
    NoListener(String),
}

/// A running viewer.
#[derive(Clone, Debug)]
pub struct Viewer(ProxyUri);

impl Viewer {
    /// Finds the viewer that listens at `address`.
    ///
    /// # Errors
    /// [`ViewerError`] if none listens there.
    pub fn find(address: &str) -> Result<Self, ViewerError> {
        let uri: ProxyUri = address
            .parse()
            .map_err(|_| ViewerError::NoAddress(address.to_owned()))?;
        let place = format!("{}:{}", uri.origin.host, uri.origin.port);
        let mut known = place.to_socket_addrs().into_iter().flatten();
        if known.any(|at| TcpStream::connect_timeout(&at, PATIENCE).is_ok()) {
            Ok(Self(uri))
        } else {
            Err(ViewerError::NoListener(place))
        }
    }
}

/// Writes to the file of a recording, and sends the same to a viewer.
pub struct FileAndViewer {
    file: RecordingFile,
    to_viewer: Option<Sender<LogMsg>>,
    sent: Receiver<()>,
}

impl FileAndViewer {
    /// Begins to send to `viewer`.
    pub fn new(file: RecordingFile, viewer: &Viewer) -> Self {
        let (to_viewer, messages) = bounded::<LogMsg>(BACKLOG);
        let (done, sent) = bounded(1);
        let uri = viewer.0.clone();
        thread::spawn(move || {
            let sink = GrpcSink::new(uri);
            messages.iter().for_each(|message| sink.send(message));
            let _ = sink.flush_blocking(PATIENCE);
            let _ = done.send(());
            // Closing may take as long as the viewer likes.
            drop(sink);
        });
        Self {
            file,
            to_viewer: Some(to_viewer),
            sent,
        }
    }
}

impl LogSink for FileAndViewer {
    fn send(&self, message: LogMsg) {
        if let Some(to_viewer) = &self.to_viewer {
            let _ = to_viewer.try_send(message.clone());
        }
        self.file.send(message);
    }

    fn flush_blocking(&self, timeout: Duration) -> Result<(), SinkFlushError> {
        self.file.flush_blocking(timeout)
    }
}

impl Drop for FileAndViewer {
    fn drop(&mut self) {
        drop(self.to_viewer.take());
        let _ = self.sent.recv_timeout(PATIENCE);
    }
}
