#include "common/config/schema.hpp"

#include <google/protobuf/text_format.h>

#include <algorithm>
#include <charconv>
#include <functional>
#include <iomanip>
#include <numeric>
#include <ostream>
#include <stdexcept>

#include "common/config/json.hpp"

namespace farhand {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;

constexpr std::size_t kColumns = 120;

// Levenshtein: how many letters must change, come or go.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (const char letter : a) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = diagonal + (letter == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

std::vector<std::string> choices(const FieldDescriptor& field) {
  std::vector<std::string> names;
  for (int i = 0; i < field.enum_type()->value_count(); ++i)
    if (field.enum_type()->value(i)->number() != 0) names.push_back(field.enum_type()->value(i)->name());
  return names;
}

std::string type_text(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return field.is_repeated() ? "list" : "group";
    case FieldDescriptor::CPPTYPE_ENUM:
      return "choice";
    case FieldDescriptor::CPPTYPE_BOOL:
      return "bool";
    case FieldDescriptor::CPPTYPE_STRING:
      return "text";
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return field_info(field).integer() ? "integer" : "number";
    default:
      return "integer";
  }
}

std::string default_text(const FieldDescriptor& field) {
  if (field_info(field).has_default_text()) return field_info(field).default_text();
  if (field.is_repeated()) return "empty";
  return field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE ? "" : "must be given";
}

using Visitor = std::function<void(const FieldDescriptor&, const std::string& path)>;

void visit_fields(const Descriptor& message, const std::string& prefix, const Visitor& visit) {
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    const std::string path = prefix + field.name() + (field.is_repeated() ? "[]" : "");
    visit(field, path);
    if (field.message_type() != nullptr) visit_fields(*field.message_type(), path + ".", visit);
  }
}

std::string range_text(const FieldDescriptor& field) {
  const scene::FieldInfo& info = field_info(field);
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_BOOL) return "false, true";
  if (!info.has_min()) return "";
  return (info.above_min() ? "(" : "[") + shortest(info.min()) + ", " + shortest(info.max()) + "]";
}

void print_wrapped(std::ostream& out, std::string_view text, const std::string& indent) {
  std::size_t column = 0;
  while (!text.empty()) {
    const std::size_t length = std::min(text.find(' '), text.size());
    if (column == 0 || column + 1 + length > kColumns) {
      out << (column == 0 ? "" : "\n") << indent;
      column = indent.size();
    } else {
      out << ' ';
      ++column;
    }
    out << text.substr(0, length);
    column += length;
    text.remove_prefix(std::min(length + 1, text.size()));
  }
  out << '\n';
}

}  // namespace

const scene::FieldInfo& field_info(const FieldDescriptor& field) { return field.options().GetExtension(scene::info); }

bool may_stay_absent(const FieldDescriptor& field) { return field_info(field).default_text() == "none"; }

std::string shortest(double number) {
  char text[32];
  const char* end = std::to_chars(std::begin(text), std::end(text), number).ptr;
  std::string digits(std::begin(text), static_cast<std::size_t>(end - text));
  // 1e+06 is 1e6 to a reader, and as good to the parser.
  if (const auto e = digits.find('e'); e != std::string::npos) {
    if (digits[e + 1] == '+') digits.erase(e + 1, 1);
    const auto exponent = digits.find_first_of("0123456789", e);
    if (digits[exponent] == '0') digits.erase(exponent, 1);
  }
  return digits;
}

std::string allowed_text(const FieldDescriptor& field) {
  const scene::FieldInfo& info = field_info(field);
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_ENUM) {
    std::string list;
    for (const std::string& name : choices(field)) list += (list.empty() ? "one of " : ", ") + name;
    return list;
  }
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_BOOL) return "true or false";
  if (!info.has_min()) return "";
  const std::string unit = info.has_unit() && info.unit() != "1" ? " " + info.unit() : "";
  const std::string kind = type_text(field) == "integer" ? "a whole number " : "a value ";
  return kind + (info.above_min() ? "above " : "from ") + shortest(info.min()) +
         (info.above_min() ? ", up to " : " to ") + shortest(info.max()) + unit;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates) {
  std::size_t best = std::max<std::size_t>(2, word.size() / 3) + 1;
  std::string closest;
  for (const std::string& candidate : candidates) {
    // Forgetting the unit is the commonest slip: a name that begins like the word counts as one change.
    const bool begins = word.size() >= 3 && candidate.starts_with(word);
    const std::size_t distance = begins ? 1 : edit_distance(word, candidate);
    if (distance < best) {
      best = distance;
      closest = candidate;
    }
  }
  return closest.empty() ? "" : ", did you mean '" + closest + "'?";
}

std::string did_you_mean_field(std::string_view word, const Descriptor& message) {
  std::vector<std::string> names;
  names.reserve(static_cast<std::size_t>(message.field_count()));
  for (int i = 0; i < message.field_count(); ++i) names.push_back(message.field(i)->name());
  return did_you_mean(word, names);
}

std::string value_text(const google::protobuf::Message& message, const FieldDescriptor& field) {
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE)
    return shortest(message.GetReflection()->GetDouble(message, &field));
  std::string text;
  google::protobuf::TextFormat::PrintFieldValueToString(message, &field, -1, &text);
  return text;
}

std::string value_text(const scene::Scene& scene, std::string_view path) {
  const google::protobuf::Message* message = &scene;
  for (std::string_view rest = path;;) {
    const std::size_t end = rest.find('.');
    const FieldDescriptor* field = message->GetDescriptor()->FindFieldByName(std::string(rest.substr(0, end)));
    if (field == nullptr || field->is_repeated() ||
        (end != std::string_view::npos) != (field->message_type() != nullptr))
      throw std::invalid_argument("a scene has no setting " + std::string(path));
    if (end == std::string_view::npos) return value_text(*message, *field);
    message = &message->GetReflection()->GetMessage(*message, field);
    rest.remove_prefix(end + 1);
  }
}

void print_schema(std::ostream& out) {
  out << std::left << std::setw(51) << "FIELD" << std::setw(9) << "TYPE" << std::setw(16) << "UNIT" << std::setw(25)
      << "RANGE"
      << "DEFAULT\n";
  visit_fields(*scene::Scene::descriptor(), "", [&out](const FieldDescriptor& field, const std::string& path) {
    if (field.message_type() != nullptr) out << '\n';
    std::string line = path + std::string(51 - std::min<std::size_t>(50, path.size()), ' ') + type_text(field);
    const auto cell = [&line](std::size_t column, const std::string& text) {
      if (text.empty()) return;
      line.resize(std::max(column, line.size() + 1), ' ');
      line += text;
    };
    cell(60, field_info(field).unit());
    cell(76, range_text(field));
    cell(101, default_text(field));
    out << line << '\n';
    std::string meaning = field_info(field).meaning();
    if (field.enum_type() != nullptr) meaning += "; " + allowed_text(field);
    print_wrapped(out, meaning, "    ");
  });
}

void print_schema_json(std::ostream& out) {
  Json fields = Json::array();
  visit_fields(*scene::Scene::descriptor(), "", [&fields](const FieldDescriptor& field, const std::string& path) {
    const scene::FieldInfo& info = field_info(field);
    Json entry = Json::object({{"field", path}, {"type", type_text(field)}, {"meaning", info.meaning()}});
    if (info.has_unit()) entry.set("unit", info.unit());
    if (info.has_min()) entry.set("min", info.min());
    if (info.above_min()) entry.set("above_min", true);
    if (info.has_max()) entry.set("max", info.max());
    if (field.enum_type() != nullptr) entry.set("choices", choices(field));
    if (info.has_default_text()) entry.set("default", info.default_text());
    entry.set("required", field.message_type() == nullptr && !info.has_default_text());
    fields.push_back(entry);
  });
  out << fields.dump(2) << '\n';
}

}  // namespace farhand
