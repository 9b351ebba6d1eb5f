// SPDX-License-Identifier: GPL-3.0-or-later
#include "report.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>

namespace srf {

namespace {

template <typename T>
T number(const Figure &figure, const void *report, std::size_t place = 0)
{
    T value;
    std::memcpy(&value, static_cast<const char *>(report) + figure.offset + sizeof value * place, sizeof value);
    return value;
}

bool is_real(const Figure &figure)
{
    return figure.kind == Figure::Kind::length || figure.kind == Figure::Kind::angle || figure.kind == Figure::Kind::ratio ||
           figure.kind == Figure::Kind::number;
}

// Whether the figure applies.
bool is_there(const Figure &figure, const void *report)
{
    if (!figure.optional) return true;
    if (is_real(figure)) return number<double>(figure, report) != SRF_FROM_DATA;
    return number<std::uint64_t>(figure, report) != std::numeric_limits<std::uint64_t>::max();
}

QVariant value(const Figure &figure, const void *report, std::size_t place)
{
    if (is_real(figure)) return number<double>(figure, report, place);
    const auto whole = number<std::uint64_t>(figure, report, place);
    switch (figure.kind) {
        case Figure::Kind::flag: return whole != 0;
        case Figure::Kind::choice: return QString(whole > 0 && whole <= figure.names.size() ? figure.names[whole - 1] : "");
        default: break;
    }
    // MeshLab has integers of 32 bits alone; larger numbers are exact as doubles up to 2^53.
    const auto is_small = number<std::int64_t>(figure, report, place);
    if (std::abs(is_small) <= std::numeric_limits<int>::max()) return static_cast<int>(is_small);
    return static_cast<double>(is_small);
}

std::string told(const Figure &figure, const void *report, std::size_t place)
{
    const double degrees = 180 / std::acos(-1.0);
    switch (figure.kind) {
        case Figure::Kind::angle: return shown(degrees * number<double>(figure, report, place)) + " degrees";
        case Figure::Kind::ratio: return shown(100 * number<double>(figure, report, place)) + " %";
        case Figure::Kind::length:
        case Figure::Kind::number: return shown(number<double>(figure, report, place));
        case Figure::Kind::integer: return std::to_string(number<std::int64_t>(figure, report, place));
        default: break;
    }
    const auto whole = number<std::uint64_t>(figure, report, place);
    switch (figure.kind) {
        case Figure::Kind::flag: return whole != 0 ? "yes" : "no";
        case Figure::Kind::choice: return whole > 0 && whole <= figure.labels.size() ? figure.labels[whole - 1] : "";
        case Figure::Kind::bytes: return shown(static_cast<double>(whole) / 1e6) + " MB";
        default: return std::to_string(whole);
    }
}

// Whether the log passes over the figure: none of what it counts was found.
bool is_nothing(const Figure &figure, const void *report)
{
    for (std::size_t place = 0; place < figure.size; ++place) {
        if (number<std::uint64_t>(figure, report, place) != 0) return false;
    }
    return true;
}

}  // namespace

Outputs values(const Figures &figures, const void *report)
{
    Outputs out;
    for (const Figure &figure : figures) {
        if (!is_there(figure, report)) continue;
        if (figure.size == 1) {
            out[figure.name] = value(figure, report, 0);
            continue;
        }
        // MeshLab hands no lists to scripts.
        for (std::size_t place = 0; place < figure.size; ++place) {
            out[std::string(figure.name) + "_" + std::to_string(place)] = value(figure, report, place);
        }
    }
    return out;
}

void log_figures(const Job &job, const Figures &figures, const void *report)
{
    std::string line;
    for (auto first = figures.begin(); first != figures.end();) {
        // Parts of one figure follow each other under its label.
        auto last = first;
        std::string values;
        bool is_anything = false;
        for (; last != figures.end() && std::strcmp(last->label, first->label) == 0; ++last) {
            if (!is_there(*last, report)) continue;
            is_anything = is_anything || !is_nothing(*last, report);
            for (std::size_t place = 0; place < last->size; ++place) values += (values.empty() ? "" : ", ") + told(*last, report, place);
        }
        if (is_anything) line += (line.empty() ? "" : "; ") + std::string(first->label) + ": " + values;
        first = last;
    }
    job.log(line);
}

}  // namespace srf
