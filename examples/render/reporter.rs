//! Progress: a bar on a terminal, plain lines elsewhere.

use std::io::IsTerminal;
use std::sync::Mutex;

use caustics::{Progress, Stage};
use indicatif::{ProgressBar, ProgressStyle};

/// Percents between two plain lines.
const PLAIN_STEP: u64 = 25;

/// Shows how far the work is.
pub(crate) struct Reporter {
    current: Mutex<Option<Current>>,
    on_terminal: bool,
}

struct Current {
    stage: Stage,
    finished: u64,
    told: u64,
    bar: Option<ProgressBar>,
}

impl Reporter {
    pub(crate) fn new() -> Self {
        Self {
            current: Mutex::new(None),
            on_terminal: std::io::stderr().is_terminal(),
        }
    }

    pub(crate) fn advance(&self, progress: Progress) {
        // A poisoned lock means that another thread panicked: it is that panic which matters.
        let Ok(mut current) = self.current.lock() else {
            return;
        };
        if current.as_ref().is_none_or(|it| it.stage != progress.stage) {
            if let Some(bar) = current.take().and_then(|it| it.bar) {
                bar.finish_and_clear();
            }
            let bar = self.on_terminal.then(|| new_bar(progress));
            *current = Some(Current {
                stage: progress.stage,
                finished: 0,
                told: 0,
                bar,
            });
        }
        let Some(current) = current.as_mut() else {
            return;
        };
        current.finished += progress.finished;
        if let Some(bar) = &current.bar {
            bar.set_position(current.finished);
            return;
        }
        let percent = 100 * current.finished / progress.total.max(1);
        if percent / PLAIN_STEP > current.told / PLAIN_STEP {
            current.told = percent;
            eprintln!("{} {percent} %", name(progress.stage));
        }
    }

    pub(crate) fn finish(&self) {
        if let Ok(mut current) = self.current.lock()
            && let Some(bar) = current.take().and_then(|it| it.bar)
        {
            bar.finish_and_clear();
        }
    }
}

fn new_bar(progress: Progress) -> ProgressBar {
    let bar = ProgressBar::new(progress.total);
    if let Ok(style) = ProgressStyle::with_template("{msg:10} {wide_bar} {percent:>3} % {eta:>4}") {
        bar.set_style(style);
    }
    bar.set_message(name(progress.stage));
    bar
}

fn name(stage: Stage) -> &'static str {
    match stage {
        Stage::Build => "building",
        Stage::Trace => "tracing",
        Stage::Render => "rendering",
        _ => "working",
    }
}
