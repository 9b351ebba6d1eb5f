//! Statuses that functions were seen to return: each status that the header lists is provoked by some test.

use std::collections::BTreeSet;
use std::io::Write as _;
use std::process::Command;
use std::sync::Mutex;

use crate::header::promised;

/// Names of the statuses, by their numbers.
pub const STATUSES: [&str; 11] = [
    "SRF_OK",
    "SRF_ERR_PARAMETER",
    "SRF_ERR_INPUT",
    "SRF_ERR_FORMAT",
    "SRF_ERR_IO",
    "SRF_ERR_OUT_OF_MEMORY",
    "SRF_ERR_CANCELLED",
    "SRF_ERR_NULL",
    "SRF_ERR_INTERNAL",
    "SRF_ERR_HANDLE",
    "SRF_ERR_STRUCT_SIZE",
];

/// Names the file that a run of the tests writes to what it sees.
const NOTES: &str = "SURFRECON_RETURNED";

/// Notes that a function returned a status.
pub fn note(name: &'static str, status: i32) {
    static SEEN: Mutex<BTreeSet<(&str, i32)>> = Mutex::new(BTreeSet::new());
    let Some(path) = std::env::var_os(NOTES) else { return };
    let is_new = SEEN.lock().unwrap().insert((name, status));
    if is_new {
        let mut file = std::fs::File::options().append(true).create(true).open(path).unwrap();
        file.write_all(format!("{name} {}\n", STATUSES[status as usize]).as_bytes()).unwrap();
    }
}

mod thorough {
    use super::*;

    /// Theorem: of each function, each status that its comment lists was returned in a run of the tests, and no other.
    #[test]
    fn each_status_that_is_listed_is_provoked() {
        let notes = tempfile::tempdir().unwrap();
        let file = notes.path().join("returned");
        let alone = |name: &'static str| [name, "--exact", "--ignored"];
        for which in [
            // Eight threads at once return what one does, in as much time as all others together.
            &["calls::", "structs::", "--skip", "every_call_from_eight_threads_at_once"][..],
            &alone("calls::contexts::there_are_only_so_many"),
            &alone("calls::contexts::memory_comes_from_the_callers_functions"),
        ] {
            let run = Command::new(std::env::current_exe().unwrap()).args(which).env(NOTES, &file).output();
            let run = run.expect("the tests run");
            assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stdout));
        }
        let returned = std::fs::read_to_string(file).unwrap();
        let returned: BTreeSet<(&str, &str)> = returned.lines().filter_map(|line| line.split_once(' ')).collect();
        let mut wrong = Vec::new();
        for (name, _, comment) in promised() {
            let said = comment.split("returns").nth(1).unwrap_or_default();
            let words: Vec<&str> = said.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
            for status in STATUSES {
                match (words.contains(&status), returned.contains(&(name.as_str(), status))) {
                    (true, false) => wrong.push(format!("{name}: nothing provokes {status}")),
                    // Any function may: what its memory was for, and mistakes of ours.
                    (false, true) if status != "SRF_ERR_OUT_OF_MEMORY" => {
                        wrong.push(format!("{name} returned {status} and does not say it"));
                    }
                    _ => {}
                }
            }
        }
        assert!(wrong.is_empty(), "{} of them:\n{}", wrong.len(), wrong.join("\n"));
    }
}
