//! The example that serves merges: many at once are as one alone, and nothing that clients do harms others.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use surfrecon::{Progress, export};

use crate::examples::{ADDRESS, THREAD, VALGRIND, has_valgrind, signal, threaded, with_suppressions};
use crate::programs::{Program, compile, square};
use crate::views::views;

/// A request: the ending of the result, and files with their names.
#[derive(Clone)]
struct Request {
    ending: &'static str,
    milliseconds: u32,
    files: Vec<(String, Vec<u8>)>,
}

impl Request {
    fn of(ending: &'static str, paths: &[String]) -> Self {
        let name = |path: &str| path.rsplit('/').next().unwrap().to_owned();
        let files = paths.iter().map(|path| (name(path), std::fs::read(path).unwrap())).collect();
        Self { ending, milliseconds: 60_000, files }
    }

    fn bytes(&self) -> Vec<u8> {
        let mut all = format!("merge {} {} {}\n", self.ending, self.milliseconds, self.files.len()).into_bytes();
        for (name, bytes) in &self.files {
            all.extend(format!("{name} {}\n", bytes.len()).into_bytes());
            all.extend(bytes);
        }
        all
    }
}

/// A running server, and what it says of requests.
struct Server {
    child: Child,
    port: u16,
    said: Mutex<Receiver<String>>,
}

impl Server {
    /// `command` is the program's, without arguments.
    fn start(mut command: Command, megabytes: u32) -> Self {
        command.args(["0", &megabytes.to_string()]).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the server runs");
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let port = line.trim().strip_prefix("listening at 127.0.0.1:").expect(&line).parse().unwrap();
        let (told, said) = channel();
        let lines = BufReader::new(child.stderr.take().unwrap()).lines();
        std::thread::spawn(move || lines.map_while(Result::ok).for_each(|line| drop(told.send(line))));
        Self { child, port, said: Mutex::new(said) }
    }

    fn connect(&self) -> TcpStream {
        TcpStream::connect(("127.0.0.1", self.port)).expect("the server listens")
    }

    /// The whole answer to some bytes.
    fn answer(&self, bytes: &[u8]) -> Vec<u8> {
        let mut stream = self.connect();
        let mut answer = vec![];
        // A server that refuses a request does not read all of it: what follows then is an error here, after the answer or in its place.
        let _ = stream.write_all(bytes);
        let _ = stream.read_to_end(&mut answer);
        answer
    }

    /// The merged surface.
    fn merged(&self, request: &Request) -> Vec<u8> {
        let answer = self.answer(&request.bytes());
        let head = answer.iter().position(|&byte| byte == b'\n').expect("a line");
        let line = String::from_utf8_lossy(&answer[..head]).into_owned();
        assert_eq!(line, format!("ok {}", answer.len() - head - 1));
        answer[head + 1..].to_vec()
    }

    /// The text of an answer that is an error.
    fn refused(&self, bytes: &[u8]) -> String {
        let answer = String::from_utf8(self.answer(bytes)).expect("a text");
        answer.trim_end().strip_prefix("error ").expect(&answer).to_owned()
    }

    /// Asks for all of them over and over, from several clients at once: each answer must be the one there is alone.
    fn all_as_alone(&self, requests: &[Request], times: usize, clients: usize) {
        let alone: Vec<_> = requests.iter().map(|request| self.merged(request)).collect();
        let next = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..clients {
                scope.spawn(|| {
                    while let Some(k) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&k| k < times) {
                        let k = k % requests.len();
                        assert!(self.merged(&requests[k]) == alone[k], "request {k} was answered otherwise than alone");
                    }
                });
            }
        });
    }

    /// Waits until the server says a line that begins so.
    fn says(&self, beginning: &str) -> Duration {
        let asked = Instant::now();
        loop {
            let line = self.said.lock().unwrap().recv_timeout(Duration::from_secs(60)).expect("a line of the server's");
            if line.starts_with(beginning) {
                return asked.elapsed();
            }
        }
    }

    /// Stops it as a system does. It must end well, with nothing that a sanitizer would have to say.
    fn stop(mut self) {
        signal(&self.child, "TERM");
        let status = self.child.wait().unwrap();
        let said: Vec<String> = self.said.lock().unwrap().iter().collect();
        assert!(status.success(), "{status}: {}", said.join("\n"));
    }
}

/// A scan as GLB and as PLY, and a list of four that it places as PLY.
fn requests(program: &Program) -> Vec<Request> {
    let folder = program.folder.path();
    let scan = square(folder, "scan.ply", 50);
    let list = folder.join("views.conf");
    let encoding = export::PlyEncoding::BinaryLittleEndian;
    let some: Vec<_> = views().iter().collect();
    export::write_scan_list(&list, &some, encoding, &Progress::none()).unwrap();
    let mut paths = vec![list.to_str().unwrap().to_owned()];
    paths.extend((0..4).map(|k| folder.join(format!("view{k}.ply")).to_str().unwrap().to_owned()));
    let one = std::slice::from_ref(&scan);
    vec![Request::of("glb", one), Request::of("ply", one), Request::of("ply", &paths)]
}

#[test]
fn bad_requests_are_told_what_is_wrong() {
    let program = threaded("merge_server.cpp", &ADDRESS);
    let request = requests(&program).swap_remove(0);
    let server = Server::start(program.command(&[]), 0);
    let first = "a request begins with a line 'merge ENDING MILLISECONDS FILES', of at most 10000 files";
    for bad in [
        "GET / HTTP/1.1\n",
        "\n",
        "merge glb 1000\n",
        "merge glb 1000 0\n",
        "merge glb 1000 10001\n",
        "merge glb -1 1\n",
        "merge glb 1e99 x\n",
    ] {
        assert_eq!(server.refused(bad.as_bytes()), first, "{bad}");
    }
    assert_eq!(server.refused(&[b'x'; 2000]), "a line of the request is too long");
    assert_eq!(server.refused(b"merge glb 1000 1\nscan.ply\n"), "a file begins with a line 'NAME SIZE'");
    for bad in ["merge glb 1000 1\na.ply 1073741825\n", "merge glb 1000 1\na.ply 18446744073709551615\n"] {
        assert_eq!(server.refused(bad.as_bytes()), "the files are more than 1073741824 bytes");
    }
    let renamed =
        |name: &str| Request { files: vec![(name.to_owned(), request.files[0].1.clone())], ..request.clone() };
    assert!(server.refused(&renamed("../scan.ply").bytes()).contains("../scan.ply"));
    let other = server.refused(&Request { ending: "xyz", ..request.clone() }.bytes());
    assert!(
        other.ends_with("result.xyz: the name must end in .ply, .glb, .stl, .3mf or .obj to hold a mesh"),
        "{other}"
    );
    let cut = Request { files: vec![("scan.ply".to_owned(), request.files[0].1[..300].to_vec())], ..request.clone() };
    assert!(server.refused(&cut.bytes()).contains("scan.ply: "));
    server.merged(&request);
    server.stop();
}

#[test]
fn a_server_without_memory_goes_on() {
    let program = threaded("merge_server.cpp", &ADDRESS);
    let small = requests(&program).swap_remove(0);
    let large = Request::of("ply", &[square(program.folder.path(), "large.ply", 900)]);
    let server = Server::start(program.command(&[]), 32);
    let said = server.refused(&large.bytes());
    assert!(said.contains("memory"), "{said}");
    server.merged(&small);
    server.stop();
}

/// Theorem: a server that is stopped answers what it is doing with an error, and ends.
#[test]
fn a_stopped_server_ends_its_merges() {
    let program = threaded("merge_server.cpp", &ADDRESS);
    let large = Request::of("ply", &[square(program.folder.path(), "large.ply", 900)]);
    let server = Server::start(program.command(&[]), 0);
    let mut stream = server.connect();
    stream.write_all(&large.bytes()).unwrap();
    std::thread::sleep(Duration::from_millis(100));
    server.stop();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert_eq!(answer, "error the server is being stopped\n");
}

mod thorough {
    use super::*;

    #[test]
    fn the_server_has_no_races() {
        let program = threaded("merge_server.cpp", &THREAD);
        let server = Server::start(with_suppressions(program.command(&[])), 0);
        server.all_as_alone(&requests(&program), 60, 8);
        assert!(server.refused(b"merge\n").starts_with("a request begins"));
        server.stop();
    }

    #[test]
    fn valgrind_has_nothing_to_report_of_the_server() {
        if !has_valgrind() {
            return;
        }
        let program = threaded("merge_server.cpp", &["-O1"]);
        let server = Server::start(program.command(&VALGRIND), 0);
        server.all_as_alone(&requests(&program)[..2], 4, 4);
        assert!(server.refused(b"merge\n").starts_with("a request begins"));
        server.stop();
    }

    /// Theorem: 200 merges of four threads give the bytes that each gives alone, which are those of the program that merges files.
    #[test]
    fn two_hundred_merges_of_four_threads_are_as_alone() {
        let program = threaded("merge_server.cpp", &ADDRESS);
        let requests = requests(&program);
        let server = Server::start(program.command(&[]), 0);
        server.all_as_alone(&requests, 200, 8);

        let files = compile("cc", &["-std=c99"], "c-api/examples/c/merge_scans.c");
        for (request, source) in [(&requests[0], "scan.ply"), (&requests[2], "views.conf")] {
            let (out, source) = (format!("result.{}", request.ending), program.folder.path().join(source));
            files.run(&[&out, source.to_str().unwrap()]);
            assert!(server.merged(request) == std::fs::read(files.folder.path().join(&out)).unwrap(), "{out}");
        }
        server.stop();
    }

    #[test]
    fn merges_end_when_their_time_is_up_or_their_client_goes() {
        let program = threaded("merge_server.cpp", &ADDRESS);
        let small = requests(&program).swap_remove(0);
        let large = Request::of("ply", &[square(program.folder.path(), "large.ply", 900)]);
        let server = Server::start(program.command(&[]), 0);
        let began = Instant::now();
        server.merged(&large);
        let whole = began.elapsed();
        server.says("ok ");

        let began = Instant::now();
        let late = server.refused(&Request { milliseconds: 100, ..large.clone() }.bytes());
        assert_eq!(late, "it took more than 100 ms");
        assert!(began.elapsed() < whole, "{:?} of {whole:?}", began.elapsed());

        // One that goes in the middle of its request, as many at once as there are threads, and one that says nothing.
        server.connect().write_all(b"merge glb 1000 1\nscan.ply 1000\nply").unwrap();
        server.says("the client went away");
        let mut gone: Vec<_> = (0..4).map(|_| server.connect()).collect();
        for stream in &mut gone {
            stream.write_all(&large.bytes()).unwrap();
        }
        drop(gone);
        let silent = server.connect();
        let waited: Duration = (0..4).map(|_| server.says("the client went away")).sum();
        assert!(waited < 2 * whole, "four merges were cancelled within {waited:?}, one takes {whole:?}");
        server.merged(&small);
        drop(silent);
        server.stop();
    }
}
