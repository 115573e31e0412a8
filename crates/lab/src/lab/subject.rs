//! The files that the lab is about, read anew when they change on disk.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, RwLock, Weak};
use std::thread;
use std::time::{Duration, SystemTime};

use answers::{CampaignInput, InputError};
use identify::Stop;
use model_lab::identification::{NuisanceSizes, Subject as Identified};

use super::Lab;
use super::told::Told;

/// How often the files are looked at.
const POLL: Duration = Duration::from_millis(500);

/// Both files, read.
#[derive(Debug)]
pub struct Subject {
    /// Counts the times that they were read.
    pub version: u64,
    /// What they say.
    pub input: CampaignInput,
    /// The campaign made ready for fits.
    pub identified: Identified,
}

impl Subject {
    /// Reads them for the first time.
    pub fn read(valve: &Path, campaign: &Path) -> Result<Self, InputError> {
        Ok(Self::new(1, CampaignInput::read(valve, campaign)?))
    }

    /// Of files that are read already and stay as they are.
    pub fn of(input: CampaignInput) -> Self {
        Self::new(0, input)
    }

    fn new(version: u64, input: CampaignInput) -> Self {
        let identified = Identified::new(&input.file, &input.campaign, &NuisanceSizes::default(), Stop::never());
        Self { version, input, identified }
    }
}

/// Length and time of the last change of each file; nothing where it cannot be looked at.
type Marks = Vec<Option<(u64, SystemTime)>>;

fn marks(files: &[PathBuf]) -> Marks {
    let mark = |file: &PathBuf| {
        let found = std::fs::metadata(file).ok()?;
        Some((found.len(), found.modified().ok()?))
    };
    files.iter().map(mark).collect()
}

/// What holds at the moment.
#[derive(Debug)]
pub struct Current {
    valve: PathBuf,
    campaign: PathBuf,
    subject: RwLock<Arc<Subject>>,
    /// Why the files as they are now cannot be used; what was read before is used on.
    trouble: Mutex<Option<String>>,
}

impl Current {
    /// After the first reading.
    pub fn new(subject: Subject, valve: &Path, campaign: &Path) -> Self {
        Self {
            valve: valve.to_path_buf(),
            campaign: campaign.to_path_buf(),
            subject: RwLock::new(Arc::new(subject)),
            trouble: Mutex::new(None),
        }
    }

    /// What was read last.
    pub fn get(&self) -> Arc<Subject> {
        self.subject.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Why the files on disk cannot be used, if they cannot.
    pub fn trouble(&self) -> Option<String> {
        self.trouble.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn set_trouble(&self, trouble: Option<String>) {
        *self.trouble.lock().unwrap_or_else(PoisonError::into_inner) = trouble;
    }

    /// Reads the files again.
    fn renew(&self) -> Result<u64, InputError> {
        let input = CampaignInput::read(&self.valve, &self.campaign)?;
        let version = self.get().version + 1;
        *self.subject.write().unwrap_or_else(PoisonError::into_inner) = Arc::new(Subject::new(version, input));
        Ok(version)
    }
}

/// Looks at the files until the lab is gone, reads them when they have changed and come to rest, and tells the pages.
pub fn watch(lab: Weak<Lab>) {
    thread::spawn(move || {
        let (mut known, mut before): (Option<Marks>, Option<Marks>) = (None, None);
        while let Some(lab) = lab.upgrade() {
            let current = &lab.current;
            let now = marks(&current.get().input.files());
            let is_at_rest = before.as_ref() == Some(&now);
            match &known {
                None => known = Some(now.clone()),
                Some(marks) if *marks != now && is_at_rest => {
                    let renewed = current.renew();
                    known = Some(marks_now(current));
                    current.set_trouble(renewed.as_ref().err().map(ToString::to_string));
                    lab.events.tell(&match renewed {
                        Ok(version) => Told::Changed { version },
                        Err(error) => Told::Trouble { message: error.to_string() },
                    });
                }
                Some(_) => {}
            }
            before = Some(now);
            drop(lab);
            thread::sleep(POLL);
        }
    });
}

/// A campaign that was read anew may name other files.
fn marks_now(current: &Current) -> Marks {
    marks(&current.get().input.files())
}
