// The job of c-api/examples/cpp/merge_server.cpp with a library that reads files from the disk alone and can't be cancelled, as Open3D and CGAL: each
// request has a folder of its own and a process that merges, which is killed if need be. server_of_processes PORT PROGRAM [MEGABYTES], PROGRAM
// called as OUT SCANS...; requests and answers are those of merge_server.cpp. POSIX alone.

#include <algorithm>
#include <arpa/inet.h>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <mutex>
#include <netinet/in.h>
#include <poll.h>
#include <spawn.h>
#include <sstream>
#include <stdexcept>
#include <string>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

extern char **environ;

namespace {

using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::milliseconds;

constexpr unsigned WORKERS = 4;
constexpr Milliseconds LONGEST{60'000};        // that a request may take
constexpr std::uint64_t MOST_BYTES = 1 << 30;  // of the files of a request
constexpr std::size_t MOST_FILES = 10'000;
constexpr std::size_t LONGEST_LINE = 1000, CHUNK = 1 << 16;

std::atomic<bool> stopping{false};

// Once asks, twice ends the program as if it were not caught.
void stop(int number)
{
    stopping = true;
    std::signal(number, SIG_DFL);
}

// Nobody is there any more to be answered.
struct Gone : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Whether what the events stand for can be done within some time, without waiting then.
bool ready(int socket, short events, Milliseconds wait)
{
    pollfd asked{};
    asked.fd = socket;
    asked.events = events;
    return poll(&asked, 1, static_cast<int>(wait.count())) > 0;
}

// The connection of a request.
class Client {
public:
    explicit Client(int socket) : socket_(socket)
    {
        const timeval longest{1, 0};
        setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &longest, sizeof longest);
    }
    ~Client() { close(socket_); }
    Client(const Client &) = delete;
    Client &operator=(const Client &) = delete;

    void allow(Milliseconds time)
    {
        allowed_ = std::min(time, LONGEST);
        deadline_ = Clock::now() + allowed_;
    }

    // Throws once the time is up, the client is gone or the server stops.
    void check() const
    {
        char next = 0;
        if (stopping) throw std::runtime_error("the server is being stopped");
        if (Clock::now() >= deadline_) throw std::runtime_error("it took more than " + std::to_string(allowed_.count()) + " ms");
        if (ready(socket_, POLLIN, Milliseconds(0)) && recv(socket_, &next, 1, MSG_PEEK) <= 0) throw Gone("the client went away");
    }

    std::vector<std::uint8_t> read(std::size_t count) const
    {
        std::vector<std::uint8_t> bytes;
        // No memory is taken for what a client only announces.
        for (std::size_t have = 0; have < count;) {
            check();
            if (!ready(socket_, POLLIN, Milliseconds(100))) continue;
            bytes.resize(std::min(count, have + CHUNK));
            const auto got = recv(socket_, &bytes[have], bytes.size() - have, 0);
            if (got <= 0) throw Gone("the client went away");
            have += static_cast<std::size_t>(got);
        }
        return bytes;
    }

    std::istringstream line() const
    {
        std::string text;
        for (std::uint8_t next = 0; (next = read(1)[0]) != '\n';) {
            if (text.size() == LONGEST_LINE) throw std::runtime_error("a line of the request is too long");
            text.push_back(static_cast<char>(next));
        }
        return std::istringstream(text);
    }

    void send(const void *bytes, std::size_t count) const
    {
        for (auto *next = static_cast<const char *>(bytes); count > 0;) {
            if (Clock::now() >= deadline_) throw Gone("the client does not take its answer");
            if (!ready(socket_, POLLOUT, Milliseconds(100))) continue;
            const auto sent = ::send(socket_, next, std::min(count, CHUNK), 0);
            if (sent <= 0) throw Gone("the client went away");
            next += sent;
            count -= static_cast<std::size_t>(sent);
        }
    }

private:
    int socket_;
    Milliseconds allowed_ = LONGEST;
    Clock::time_point deadline_ = Clock::now() + LONGEST;
};

// A folder of its own, which goes with all that is in it.
class Scratch {
public:
    Scratch()
    {
        std::string name = (std::filesystem::temp_directory_path() / "merge-XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("there is no place for the files");
        folder_ = name;
    }
    ~Scratch()
    {
        std::error_code ignored;
        std::filesystem::remove_all(folder_, ignored);
    }
    Scratch(const Scratch &) = delete;
    Scratch &operator=(const Scratch &) = delete;
    std::string path(const std::string &name) const { return (folder_ / name).string(); }

private:
    std::filesystem::path folder_;
};

// A process that merges; it is killed if it still runs when this ends.
class Process {
public:
    Process(std::vector<std::string> words, const std::string &log)
    {
        std::vector<char *> arguments;
        for (std::string &word : words) arguments.push_back(word.data());
        arguments.push_back(nullptr);
        posix_spawn_file_actions_t files;
        posix_spawn_file_actions_init(&files);
        posix_spawn_file_actions_addopen(&files, 1, "/dev/null", O_WRONLY, 0);
        posix_spawn_file_actions_addopen(&files, 2, log.c_str(), O_WRONLY | O_CREAT, 0600);
        const int failed = posix_spawn(&process_, arguments[0], &files, nullptr, arguments.data(), environ);
        posix_spawn_file_actions_destroy(&files);
        if (failed != 0) throw std::runtime_error("the program that merges can't be started");
    }
    ~Process()
    {
        if (ended_) return;
        kill(process_, SIGKILL);
        waitpid(process_, &status_, 0);
    }
    Process(const Process &) = delete;
    Process &operator=(const Process &) = delete;

    bool ended()
    {
        ended_ = ended_ || waitpid(process_, &status_, WNOHANG) == process_;
        return ended_;
    }
    bool went_well() const { return WIFEXITED(status_) && WEXITSTATUS(status_) == 0; }

private:
    pid_t process_ = 0;
    int status_ = 0;
    bool ended_ = false;
};

std::string contents(const std::string &path)
{
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

// Reads a request, and the files into a folder; the ending of the result.
std::string receive(Client &client, const Scratch &scratch, std::vector<std::string> &paths)
{
    std::string verb, ending, name;
    std::int64_t milliseconds = 0;
    std::size_t count = 0;
    std::uint64_t size = 0, left = MOST_BYTES;
    if (!(client.line() >> verb >> ending >> milliseconds >> count) || verb != "merge" || milliseconds < 0 || count == 0 ||
        count > MOST_FILES)
        throw std::runtime_error("a request begins with a line 'merge ENDING MILLISECONDS FILES', of at most " + std::to_string(MOST_FILES) + " files");
    client.allow(Milliseconds(milliseconds));
    for (std::size_t i = 0; i < count; ++i) {
        if (!(client.line() >> name >> size)) throw std::runtime_error("a file begins with a line 'NAME SIZE'");
        if (size > left) throw std::runtime_error("the files are more than " + std::to_string(MOST_BYTES) + " bytes");
        left -= size;
        const std::vector<std::uint8_t> bytes = client.read(static_cast<std::size_t>(size));
        if (name.find('/') != std::string::npos || name[0] == '.') throw std::runtime_error(name + " is no name of a file");
        paths.push_back(scratch.path(name));
        std::ofstream file(paths.back(), std::ios::binary);
        file.write(reinterpret_cast<const char *>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        if (!file.flush()) throw std::runtime_error(name + " can't be kept");
    }
    return ending;
}

// Does what a request asks for, and sends the result; what is said of it.
std::string serve(Client &client, const std::string &program, long long megabytes)
{
    const Scratch scratch;
    std::vector<std::string> words, paths;
    const std::string ending = receive(client, scratch, paths), out = scratch.path(".result." + ending), log = scratch.path(".log");
    // The limit is one process's: the library knows none for all that it does together.
    if (megabytes > 0) words = {"/bin/sh", "-c", "ulimit -v $0; exec \"$@\"", std::to_string(1024 * megabytes)};
    words.insert(words.end(), {program, out});
    words.insert(words.end(), paths.begin(), paths.end());
    Process process(words, log);
    while (!process.ended()) {
        client.check();
        std::this_thread::sleep_for(Milliseconds(10));
    }
    if (!process.went_well()) throw std::runtime_error("merging failed: " + contents(log));
    const std::string bytes = contents(out), head = "ok " + std::to_string(bytes.size()) + "\n";
    client.send(head.data(), head.size());
    client.send(bytes.data(), bytes.size());
    return head;
}

// One of the threads: a request after the other.
void work(int listener, std::mutex &door, const std::string &program, long long megabytes)
{
    while (true) {
        int accepted = -1;
        {
            const std::lock_guard<std::mutex> lock(door);
            if (stopping) return;
            if (ready(listener, POLLIN, Milliseconds(200))) accepted = accept(listener, nullptr, nullptr);
        }
        if (accepted == -1) continue;
        Client client(accepted);
        std::string said;
        try {
            said = serve(client, program, megabytes);
        } catch (const Gone &gone) {
            said = std::string(gone.what()) + "\n";
        } catch (const std::exception &error) {
            said = std::string("error ") + error.what();
            std::replace(said.begin(), said.end(), '\n', ' ');
            said += "\n";
            client.allow(Milliseconds(1000));
            try {
                client.send(said.data(), said.size());
            } catch (const Gone &) {
                said.insert(0, "not taken: ");
            }
        }
        std::cerr << said;
    }
}

// Listens on this machine; the port, which is said.
int listen_at(unsigned short port)
{
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    const int listener = socket(AF_INET, SOCK_STREAM, 0);
    // The port may be used again at once after a server has ended.
    const int reuse = 1;
    setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &reuse, sizeof reuse);
    if (listener == -1 || bind(listener, reinterpret_cast<sockaddr *>(&address), size) != 0 || listen(listener, 100) != 0 ||
        getsockname(listener, reinterpret_cast<sockaddr *>(&address), &size) != 0)
        throw std::runtime_error("can't listen at port " + std::to_string(port) + ": is it in use?");
    std::cout << "listening at 127.0.0.1:" << ntohs(address.sin_port) << std::endl;
    return listener;
}

}  // namespace

int main(int argc, char **argv)
try {
    const int port = argc > 1 ? std::atoi(argv[1]) : -1;
    const long long megabytes = argc > 3 ? std::atoll(argv[3]) : 0;
    if (argc < 3 || port < 0 || port > 65535 || megabytes < 0) {
        std::cerr << "usage: " << argv[0] << " PORT PROGRAM [MEGABYTES]\n";
        return 2;
    }
    // A client that went away is an error of send().
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGINT, stop);
    std::signal(SIGTERM, stop);
    const int listener = listen_at(static_cast<unsigned short>(port));
    std::mutex door;
    std::vector<std::thread> workers;
    for (unsigned i = 0; i < WORKERS; ++i) workers.emplace_back(work, listener, std::ref(door), argv[2], megabytes);
    for (std::thread &worker : workers) worker.join();
    close(listener);
    return EXIT_SUCCESS;
} catch (const std::exception &error) {
    std::cerr << error.what() << '\n';
    return EXIT_FAILURE;
}
