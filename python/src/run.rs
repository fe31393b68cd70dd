//! Work on a thread of its own, while the interpreter's thread passes on events and listens for Ctrl-C.

use crate::errors::{Failure, warn, wrong};
use fmnet::events::{Event, Observer};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How long a signal may wait.
const POLL: Duration = Duration::from_millis(50);
/// Of each thread of the pool, as the main thread of a program has.
const STACK: usize = 8 << 20;

enum Message<T> {
    Event(Event),
    Done(std::thread::Result<Result<T, Failure>>),
}

/// Why the work was left: nobody waits for it any more.
struct Abandoned;

/// Runs `work` without the interpreter's lock. Warnings become Python warnings, stages go to `progress`. Where
/// Ctrl-C, a warning that is an error or the callback ends the wait, the work is left at once and ends itself at its
/// next stage.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(Observer) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let pool = pool()?;
    let is_abandoned = Arc::new(AtomicBool::new(false));
    let (sender, mut receiver) = channel();
    let flag = is_abandoned.clone();
    let body = move || {
        let observer = |event| {
            if flag.load(Ordering::Relaxed) || sender.send(Message::Event(event)).is_err() {
                resume_unwind(Box::new(Abandoned));
            }
        };
        let outcome = catch_unwind(AssertUnwindSafe(|| pool.install(|| work(&observer))));
        // Where nobody listens any more, nobody wants the outcome.
        let _ = sender.send(Message::Done(outcome));
    };
    std::thread::Builder::new().name("fmnet".into()).spawn(body).map_err(wrong)?;
    loop {
        let (returned, message) = py.detach(move || wait(receiver));
        receiver = returned;
        let heard = match message {
            Ok(Message::Done(outcome)) => return finished(outcome),
            Ok(Message::Event(event)) => deliver(py, event, progress),
            Err(RecvTimeoutError::Timeout) => Ok(()),
            Err(RecvTimeoutError::Disconnected) => Err(wrong("the computation ended without a result")),
        };
        if let Err(error) = heard.and_then(|()| py.check_signals()) {
            is_abandoned.store(true, Ordering::Relaxed);
            return Err(error);
        }
    }
}

type Next<T> = Result<Message<T>, RecvTimeoutError>;

fn wait<T>(receiver: Receiver<Message<T>>) -> (Receiver<Message<T>>, Next<T>) {
    let message = receiver.recv_timeout(POLL);
    (receiver, message)
}

fn finished<T>(outcome: std::thread::Result<Result<T, Failure>>) -> PyResult<T> {
    match outcome {
        Ok(result) => Ok(result?),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no reason given");
            Err(wrong(format!("a failure of fmnet itself, please report it: {text}")))
        }
    }
}

fn deliver(py: Python<'_>, event: Event, progress: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
    let (subject, stage, seconds) = match event {
        Event::Warning(text) => return warn(py, &text),
        Event::Started { subject, stage } => (subject, stage, None),
        Event::Finished { subject, stage, seconds } => (subject, stage, Some(seconds)),
        _ => return Ok(()),
    };
    match progress {
        Some(progress) => progress.call1((subject, stage, seconds)).map(drop),
        None => Ok(()),
    }
}

/// The pool of this process: a forked child has none of its parent's threads, and would wait for them forever.
fn pool() -> PyResult<Arc<ThreadPool>> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if let Some((_, known)) = pool.as_ref().filter(|(owner, _)| *owner == process) {
        return Ok(known.clone());
    }
    let made = ThreadPoolBuilder::new().stack_size(STACK).thread_name(|i| format!("fmnet-{i}")).build();
    let made = Arc::new(made.map_err(wrong)?);
    // The threads of a parent are not there to be ended.
    std::mem::forget(pool.replace((process, made.clone())));
    Ok(made)
}
