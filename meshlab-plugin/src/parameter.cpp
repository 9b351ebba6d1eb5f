// SPDX-License-Identifier: GPL-3.0-or-later
#include "parameter.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "filter.h"

namespace srf {
namespace {

constexpr double pi = 3.14159265358979323846;

bool is_one_of(const char *name, std::initializer_list<const char *> names)
{
    return std::any_of(names.begin(), names.end(), [name](const char *other) { return std::strcmp(name, other) == 0; });
}

// The number for a field; what is left as it was keeps the library's own default, of which MeshLab has the single precision.
double number(double value, const Parameter &parameter)
{
    return static_cast<float>(value) == static_cast<float>(parameter.initial) ? parameter.initial : value;
}

[[noreturn]] void refuse_below(const Parameter &parameter, double least, double value)
{
    refuse(std::string(parameter.name) + " must be at least " + shown(least) + ", got " + shown(value) +
           (parameter.from_data ? ", where 0 stands for what the data give" : ""));
}

double given_value(const RichParameterList &given, const Parameter &parameter)
{
    const QString name = parameter.name;
    switch (parameter.kind) {
    case Kind::length:
        return length(given, parameter.name, parameter.from_data);
    case Kind::angle: {
        const double value = number(given.getFloat(name), parameter);
        if (!(value >= parameter.least && value <= parameter.most)) {
            refuse(std::string(parameter.name) + " must be " + shown(parameter.least) + " to " + shown(parameter.most) + " degrees, got " +
                   shown(value));
        }
        return value * (pi / 180);
    }
    case Kind::ratio: {
        const double value = number(given.getFloat(name), parameter);
        // One negative number means something else to the library.
        if (parameter.from_data && !(value >= 0)) refuse_below(parameter, 0, value);
        return parameter.from_data && value == 0 ? SRF_FROM_DATA : value;
    }
    case Kind::count: {
        const int value = given.getInt(name);
        if (value < 0) refuse_below(parameter, parameter.from_data ? 0 : parameter.least, value);
        return parameter.from_data && !parameter.whole && value == 0 ? SRF_FROM_DATA : value;
    }
    case Kind::flag:
        return given.getBool(name) ? 1 : 0;
    case Kind::choice:
        return given.getEnum(name) + 1;
    case Kind::number_or_none: {
        const QString text = given.getString(name).trimmed();
        bool good = true;
        const double value = text.isEmpty() ? std::numeric_limits<double>::quiet_NaN() : text.toDouble(&good);
        if (!good) refuse(std::string(parameter.name) + " must be a number or empty, got \"" + text.toUtf8().constData() + "\"");
        return value;
    }
    }
    return 0;
}

}  // namespace

void add_parameters(RichParameterList &list, const Parameters &parameters, double longest, std::initializer_list<const char *> but)
{
    for (const Parameter &p : parameters) {
        if (is_one_of(p.name, but)) continue;
        const auto initial = static_cast<compat::Number>(p.initial);
        const QString name = p.name, label = text(p.label), tip = text(p.tip);
        switch (p.kind) {
        case Kind::length:
            list.addParam(compat::LengthParameter(name, static_cast<Scalarm>(p.initial), 0, static_cast<Scalarm>(longest), label, tip));
            break;
        case Kind::angle:
        case Kind::ratio: list.addParam(RichFloat(name, initial, label, tip)); break;
        case Kind::count: list.addParam(RichInt(name, static_cast<int>(p.initial), label, tip)); break;
        case Kind::flag: list.addParam(RichBool(name, p.initial != 0, label, tip)); break;
        case Kind::choice: {
            QStringList choices;
            for (const char *choice : p.choices) choices << text(choice);
            list.addParam(RichEnum(name, static_cast<int>(p.initial), choices, label, tip));
            break;
        }
        case Kind::number_or_none: list.addParam(RichString(name, "", label, tip)); break;
        }
    }
}

void read_parameters(const RichParameterList &given, const Parameters &parameters, void *into, std::initializer_list<const char *> but)
{
    for (const Parameter &p : parameters) {
        if (is_one_of(p.name, but)) continue;
        const double value = given_value(given, p);
        char *const field = static_cast<char *>(into) + p.offset;
        if (p.whole) {
            const auto count = static_cast<std::uint64_t>(value);
            std::memcpy(field, &count, sizeof count);
        } else {
            std::memcpy(field, &value, sizeof value);
        }
    }
}

double diagonal(const MeshModel *layer)
{
    const double found = layer == nullptr || layer->cm.bbox.IsNull() ? 0 : static_cast<double>(layer->cm.bbox.Diag());
    return std::isfinite(found) && found > 0 ? found : 1;
}

}  // namespace srf
