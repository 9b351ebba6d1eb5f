// Merges scans for others: four threads take requests over TCP, each with the bytes of files in any format, and answer with the merged
// surface. Nothing touches the disk. A merge ends when its time is up, when its client goes away, or when the server is stopped by Ctrl-C.
// Usage: merge_server PORT [MEGABYTES]      PORT 0 for any that is free, MEGABYTES that each merge may take
//
// A connection carries one request and its answer, lines end with '\n':
//     merge ENDING MILLISECONDS FILES       ENDING of the result: glb, ply, obj or stl; MILLISECONDS the answer may take
//     NAME SIZE                             for each file, followed by SIZE bytes; a list among the files places the scans
// is answered by
//     ok SIZE                               followed by SIZE bytes
//     error TEXT
// The client keeps its side open until it has the answer. It listens on this machine alone: requests are not authenticated. C++17.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <surfrecon.hpp>

#ifdef _WIN32
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <winsock2.h>
using Length = int;
#define poll WSAPoll
#define close closesocket
#else
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>
using SOCKET = int;
using Length = socklen_t;
constexpr SOCKET INVALID_SOCKET = -1;
#endif

namespace {

using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::milliseconds;

constexpr unsigned WORKERS = 4;
constexpr Milliseconds LONGEST{60'000};        // that a request may take
constexpr std::uint64_t MOST_BYTES = 1 << 30;  // of the files of a request
constexpr std::size_t MOST_FILES = 10'000;
constexpr std::size_t LONGEST_LINE = 1000, CHUNK = 1 << 16;

std::atomic<bool> stopping{false};
std::uint64_t most_memory = 0;  // that a request may take, in bytes; 0 for as much as there is

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
bool ready(SOCKET socket, short events, Milliseconds wait)
{
    pollfd asked{};
    asked.fd = socket;
    asked.events = events;
    return poll(&asked, 1, static_cast<int>(wait.count())) > 0;
}

// The connection of a request.
class Client {
public:
    explicit Client(SOCKET socket) : socket_(socket)
    {
#ifdef _WIN32
        const DWORD longest = 1000;
#else
        const timeval longest{1, 0};
#endif
        setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, reinterpret_cast<const char *>(&longest), sizeof longest);
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
            const auto got = recv(socket_, reinterpret_cast<char *>(&bytes[have]), static_cast<Length>(bytes.size() - have), 0);
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
            const auto sent = ::send(socket_, next, static_cast<Length>(std::min(count, CHUNK)), 0);
            if (sent <= 0) throw Gone("the client went away");
            next += sent;
            count -= static_cast<std::size_t>(sent);
        }
    }

private:
    SOCKET socket_;
    Milliseconds allowed_ = LONGEST;
    Clock::time_point deadline_ = Clock::now() + LONGEST;
};

// Reads a request, and the files into a folder in memory; the ending of the result.
std::string receive(Client &client, surfrecon::Folder &files)
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
        files.put(name, bytes.data(), bytes.size());
    }
    return ending;
}

// Does what a request asks for, and sends the result; what is said of it.
std::string serve(Client &client)
{
    // The memory of one request is nothing to the limit of another, and its threads work for nobody else.
    surfrecon::Context context;
    context.set_memory_limit(most_memory);
    context.set_threads(std::max(1U, std::thread::hardware_concurrency() / WORKERS));
    const surfrecon::Use use(context);
    surfrecon::Folder files, results;
    const std::string result = "result." + receive(client, files);
    const auto watch = [&](const surfrecon::Tick &) { return client.check(), true; };
    surfrecon::Merger merger;
    merger.add(surfrecon::Scans::open({files.path()}, {}, watch));
    merger.run({}, watch).mesh.write(results.path(result), {}, watch);
    const auto bytes = results.bytes(result);
    const std::string head = "ok " + std::to_string(bytes.size()) + "\n";
    client.send(head.data(), head.size());
    client.send(bytes.data(), bytes.size());
    return head;
}

// One of the threads: a request after the other.
void work(SOCKET listener, std::mutex &door)
{
    while (true) {
        SOCKET accepted = INVALID_SOCKET;
        {
            const std::lock_guard<std::mutex> lock(door);
            if (stopping) return;
            if (ready(listener, POLLIN, Milliseconds(200))) accepted = accept(listener, nullptr, nullptr);
        }
        if (accepted == INVALID_SOCKET) continue;
        Client client(accepted);
        std::string said;
        try {
            said = serve(client);
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
SOCKET listen_at(unsigned short port)
{
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    Length size = sizeof address;
    const SOCKET listener = socket(AF_INET, SOCK_STREAM, 0);
#ifndef _WIN32
    // The port may be used again at once after a server has ended; on Windows it may anyway, and the option would let two share it.
    const int reuse = 1;
    setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &reuse, sizeof reuse);
#endif
    if (listener == INVALID_SOCKET || bind(listener, reinterpret_cast<sockaddr *>(&address), size) != 0 || listen(listener, 100) != 0 ||
        getsockname(listener, reinterpret_cast<sockaddr *>(&address), &size) != 0)
        throw std::runtime_error("can't listen at port " + std::to_string(port) + ": is it in use?");
    std::cout << "listening at 127.0.0.1:" << ntohs(address.sin_port) << std::endl;
    return listener;
}

}  // namespace

int main(int argc, char **argv)
try {
    const int port = argc > 1 ? std::atoi(argv[1]) : -1;
    const long long megabytes = argc > 2 ? std::atoll(argv[2]) : 0;
    if (port < 0 || port > 65535 || megabytes < 0) {
        std::cerr << "usage: " << argv[0] << " PORT [MEGABYTES]\n";
        return 2;
    }
    surfrecon::check_abi();
    most_memory = static_cast<std::uint64_t>(megabytes) << 20;
#ifdef _WIN32
    WSADATA data;
    if (WSAStartup(MAKEWORD(2, 2), &data) != 0) throw std::runtime_error("no sockets");
#else
    // A client that went away is an error of send().
    std::signal(SIGPIPE, SIG_IGN);
#endif
    std::signal(SIGINT, stop);
    std::signal(SIGTERM, stop);
    const SOCKET listener = listen_at(static_cast<unsigned short>(port));
    std::mutex door;
    std::vector<std::thread> workers;
    for (unsigned i = 0; i < WORKERS; ++i) workers.emplace_back(work, listener, std::ref(door));
    for (std::thread &worker : workers) worker.join();
    close(listener);
    return EXIT_SUCCESS;
} catch (const std::exception &error) {
    std::cerr << error.what() << '\n';
    return EXIT_FAILURE;
}
