#include "common/record/export.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>

#include "common/files/output_stream.hpp"
#include "common/record/mat_file.hpp"
#include "common/record/mcap_reader.hpp"
#include "common/record/sample_codec.hpp"
#include "common/record/stamps.hpp"
#include "common/signal/joints.hpp"
#include "proto/record.pb.h"

namespace farhand {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr const char* kTopics[] = {"master", "slave", "netem", "mcu", "events"};
constexpr const char* kInfo = "info.txtpb";

// One column: a field, or one of the values that it holds.
struct Cell {
  const FieldDescriptor* field;
  int index;  // in a repeated field
  std::string name;
};

bool is_text(const Cell& cell) { return cell.field->cpp_type() == FieldDescriptor::CPPTYPE_STRING; }

// What one topic is made of. The messages are ours, so their types are the ones compiled in.
struct Table {
  explicit Table(const Message& prototype) : message(prototype.New()) {}

  // signals: what is in a repeated field; their values have had fields of their own before they had names.
  void columns(const record::RunInfo& info, bool master) {
    if (!cells.empty()) return;
    const std::vector<std::string> signals = signals_of(info, master);
    for (int i = 0; i < message->GetDescriptor()->field_count(); ++i) {
      const FieldDescriptor* field = message->GetDescriptor()->field(i);
      if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) continue;
      if (field->is_repeated()) {
        for (int k = 0; info.signals_named() && k < static_cast<int>(signals.size()); ++k)
          cells.push_back({field, k, signals[static_cast<std::size_t>(k)]});
      } else if (!info.signals_named() || std::ranges::find(kUnnamedSignals, field->name()) == kUnnamedSignals.end()) {
        cells.push_back({field, 0, field->name()});
      }
    }
  }

  std::unique_ptr<Message> message;
  std::vector<Cell> cells;  // the first is the time
};

// Calls `take` with the value of a number in its own type.
template <class Take>
void with_number(const Message& message, const Cell& cell, const Take& take) {
  const FieldDescriptor* field = cell.field;
  const auto* get = message.GetReflection();
  if (field->is_repeated()) return take(get->GetRepeatedDouble(message, field, cell.index));
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return take(get->GetDouble(message, field));
    case FieldDescriptor::CPPTYPE_INT64:
      return take(get->GetInt64(message, field));
    case FieldDescriptor::CPPTYPE_UINT64:
      return take(get->GetUInt64(message, field));
    case FieldDescriptor::CPPTYPE_UINT32:
      return take(get->GetUInt32(message, field));
    case FieldDescriptor::CPPTYPE_BOOL:
      return take(get->GetBool(message, field) ? std::uint32_t{1} : std::uint32_t{0});
    default:
      throw std::logic_error("record.proto has a field of a kind that is not exported: " + field->full_name());
  }
}

bool known(const Message& message, const Cell& cell) {
  const auto* get = message.GetReflection();
  if (!cell.field->is_repeated()) return !cell.field->has_presence() || get->HasField(message, cell.field);
  return cell.index < get->FieldSize(message, cell.field) &&
         !std::isnan(get->GetRepeatedDouble(message, cell.field, cell.index));
}

double time_s(const Message& message, const FieldDescriptor* t_ns, Nanoseconds start) {
  return to_seconds(stamp_difference(message.GetReflection()->GetInt64(message, t_ns), start));
}

// Walks a recording: `row` gets each message of a topic (without the leading slash) and its time.
struct Walked {
  record::RunInfo info;
  std::vector<std::string> problems;
};
Walked walk(const std::filesystem::path& recording,
            const std::function<void(const std::string& topic, const Table& table, double t_s)>& row) {
  // Only these: a topic becomes the name of a file.
  std::map<std::string, Table> tables;
  tables.emplace("/master", record::StationSample::default_instance());
  tables.emplace("/slave", record::StationSample::default_instance());
  tables.emplace("/netem", record::LinkSample::default_instance());
  tables.emplace("/mcu", record::McuSample::default_instance());
  tables.emplace("/events", record::Event::default_instance());

  Walked walked;
  bool informed = false;
  std::uint64_t unknown = 0;
  const auto parse = [](const McapMessage& from, Message& into) {
    return from.channel.schema_name == into.GetDescriptor()->full_name() &&
           from.data.size() <= std::numeric_limits<int>::max() &&
           into.ParseFromArray(from.data.data(), static_cast<int>(from.data.size()));
  };
  const auto read = [&](const McapMessage& message) {
    if (message.channel.topic == "/info") {
      informed = parse(message, walked.info) || informed;
      return;
    }
    const auto found = tables.find(message.channel.topic);
    if (found == tables.end() || !parse(message, *found->second.message)) {
      ++unknown;
      return;
    }
    Table& table = found->second;
    table.columns(walked.info, message.channel.topic == "/master");
    row(message.channel.topic.substr(1), table,
        time_s(*table.message, table.cells.front().field, walked.info.start_ns()));
  };
  walked.problems = read_mcap(recording, read).problems;
  if (!informed) {
    throw std::runtime_error(recording.string() + " is no recording of farhand: nothing tells which run it is");
  }
  if (unknown > 0) {
    walked.problems.push_back(recording.filename().string() + ": " + std::to_string(unknown) +
                              " messages of a kind that is not known were left out");
  }
  return walked;
}

// Shortest text that reads back as the same number; std::to_chars knows no locale.
template <class Number>
void append_number(std::string& line, Number value) {
  std::array<char, 32> text;
  line.append(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
}

void append_quoted(std::string& line, const std::string& text) {
  line.push_back('"');
  for (const char c : text) line.append(c == '"' ? 2 : 1, c);
  line.push_back('"');
}

}  // namespace

Exported export_csv(const std::filesystem::path& recording, const std::filesystem::path& directory) {
  make_directories(directory);
  // All of one export carry one number, whatever topics it turns out to have.
  std::vector<std::filesystem::path> all{directory / kInfo};
  for (const char* topic : kTopics) all.push_back(directory / (std::string(topic) + ".csv"));
  const int number = free_number(all);
  std::map<std::string, OutputStream> files;
  std::string line;
  const Walked walked = walk(recording, [&](const std::string& topic, const Table& table, double t_s) {
    const auto [file, is_new] = files.try_emplace(topic, numbered(directory / (topic + ".csv"), number));
    line.clear();
    if (is_new) {
      line = "t_s";
      for (const Cell& cell : table.cells) line.append(",").append(cell.name);
      line.push_back('\n');
    }
    append_number(line, t_s);
    for (const Cell& cell : table.cells) {
      line.push_back(',');
      if (is_text(cell)) {
        append_quoted(line, table.message->GetReflection()->GetString(*table.message, cell.field));
      } else if (known(*table.message, cell)) {
        with_number(*table.message, cell, [&](auto value) { append_number(line, value); });
      }
    }
    line.push_back('\n');
    file->second.write(line.data(), static_cast<std::streamsize>(line.size()));
  });

  Exported exported{{}, walked.problems};
  const auto finish = [&](OutputStream& out) {
    out.finish();
    exported.files.push_back(out.made().file());
  };
  for (auto& [topic, out] : files) finish(out);
  std::string info;
  google::protobuf::TextFormat::PrintToString(walked.info, &info);
  OutputStream out(numbered(directory / kInfo, number));
  out << info;
  finish(out);
  return exported;
}

Exported export_mat(const std::filesystem::path& recording, const std::filesystem::path& mat_file) {
  struct Matrix {
    std::vector<std::string> names;
    std::vector<std::vector<double>> columns;
    std::map<std::string, std::vector<std::string>> texts;
  };
  std::map<std::string, Matrix> matrices;
  const Walked walked = walk(recording, [&](const std::string& topic, const Table& table, double t_s) {
    Matrix& matrix = matrices[topic];
    if (matrix.names.empty()) {
      matrix.names.push_back("t_s");
      for (const Cell& cell : table.cells) {
        if (!is_text(cell)) matrix.names.push_back(cell.name);
      }
      matrix.columns.resize(matrix.names.size());
    }
    auto column = matrix.columns.begin();
    (column++)->push_back(t_s);
    for (const Cell& cell : table.cells) {
      if (is_text(cell)) {
        matrix.texts[cell.name].push_back(table.message->GetReflection()->GetString(*table.message, cell.field));
      } else if (!known(*table.message, cell)) {
        (column++)->push_back(std::numeric_limits<double>::quiet_NaN());
      } else {
        with_number(*table.message, cell, [&](auto value) { (column++)->push_back(static_cast<double>(value)); });
      }
    }
  });

  OutputStream out(mat_file);
  for (const auto& [topic, matrix] : matrices) {
    mat::write_doubles(out, topic, matrix.columns);
    mat::write_text(out, topic + "_columns", matrix.names);
    for (const auto& [field, lines] : matrix.texts) mat::write_text(out, topic + "_" + field, lines);
  }
  out.finish();
  return {{out.made().file()}, walked.problems};
}

}  // namespace farhand
