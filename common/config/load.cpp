#include "common/config/load.hpp"

#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <boost/nowide/utf/utf.hpp>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>

#include "common/config/check.hpp"
#include "common/config/schema.hpp"

namespace farhand {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::TextFormat;

constexpr std::size_t kMaxBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxSentences = 50;
constexpr int kMaxDepth =
    16;  // scene.proto nests four deep; without a limit the parser's stack is the file's to exhaust
constexpr const char* kEnding = ".txtpb";

class Mistakes {
 public:
  bool full() const { return sentences_.size() >= kMaxSentences; }
  // One sentence is one line, also if it quotes a tab or a line break of the command line.
  void add(const std::string& place, const std::string& sentence) {
    if (full()) {
      ++more_;
      return;
    }
    std::string& line = sentences_.emplace_back(place + ": " + sentence);
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c == '\t' || c == '\r' || c == '\n'; }, ' ');
  }
  void throw_if_any() const {
    if (sentences_.empty()) return;
    std::string all;
    for (const std::string& sentence : sentences_) all += (all.empty() ? "" : "\n") + sentence;
    if (more_ > 0) all += "\nand " + std::to_string(more_) + " more mistakes";
    throw ConfigError(all);
  }

 private:
  std::vector<std::string> sentences_;
  std::size_t more_ = 0;
};

// Lines and columns of a text, counted as the parser does: from 0, in bytes, a tab ends at the next multiple of eight.
class Rows {
 public:
  explicit Rows(std::string_view text) : text_(text) {}

  std::size_t offset(int line, int column) const {
    Cursor at;
    std::size_t i = 0;
    while (i < text_.size() && (at.line < line || (at.line == line && at.column < column))) at.pass(text_[i++]);
    return i;
  }

  std::string describe(std::size_t offset) const {
    Cursor at;
    for (const char c : text_.substr(0, offset)) at.pass(c);
    return describe(at.line, at.column);
  }

  static std::string describe(int line, int column) {
    return ":" + std::to_string(line + 1) + ":" + std::to_string(column + 1);
  }

  std::string_view text() const { return text_; }

 private:
  struct Cursor {
    int line = 0, column = 0;
    void pass(char c) {
      if (c == '\n') {
        ++line;
        column = 0;
      } else {
        column += c == '\t' ? 8 - column % 8 : 1;
      }
    }
  };

  std::string_view text_;
};

// The place where each field of the scene was written: "file:line:column", "--set a.b=c". A field that was not written
// has the place of the group around it.
class Places {
 public:
  explicit Places(const std::string& file) { places_[""] = file; }

  void add_tree(const Message& message, const TextFormat::ParseInfoTree& tree, const std::string& prefix = "") {
    const auto& reflection = *message.GetReflection();
    std::vector<const FieldDescriptor*> fields;
    reflection.ListFields(message, &fields);
    for (const FieldDescriptor* field : fields) {
      const int count = field->is_repeated() ? reflection.FieldSize(message, field) : 1;
      for (int i = 0; i < count; ++i) {
        const int index = field->is_repeated() ? i : -1;
        const std::string path = prefix + field->name() + (field->is_repeated() ? "[" + std::to_string(i) + "]" : "");
        const auto at = tree.GetLocation(field, index);
        if (at.line >= 0) places_[path] = places_[""] + Rows::describe(at.line, at.column);
        if (field->message_type() == nullptr) continue;
        const Message& nested = field->is_repeated() ? reflection.GetRepeatedMessage(message, field, i)
                                                     : reflection.GetMessage(message, field);
        if (const auto* nested_tree = tree.GetTreeForNested(field, index)) add_tree(nested, *nested_tree, path + ".");
      }
    }
  }

  void overwrite(const std::string& path, const std::string& place) {
    std::erase_if(places_, [&path](const auto& entry) { return entry.first.starts_with(path + "."); });
    places_[path] = place;
  }

  std::string find(std::string path) const {
    while (true) {
      if (const auto found = places_.find(path); found != places_.end()) return found->second;
      const auto dot = path.rfind('.');
      path.resize(dot == std::string::npos ? 0 : dot);
    }
  }

 private:
  std::map<std::string, std::string> places_;
};

std::string quoted(const std::string& sentence, int which) {
  std::size_t begin = 0, end = 0;
  for (int i = 0; i <= which; ++i) {
    begin = sentence.find('"', i == 0 ? 0 : end + 1);
    end = begin == std::string::npos ? begin : sentence.find('"', begin + 1);
    if (end == std::string::npos) return "";
  }
  return sentence.substr(begin + 1, end - begin - 1);
}

// Takes the sentences of the parser and adds the values that would be allowed. The parser only warns of unknown fields,
// so that one does not hide the next; here they are mistakes like the others.
class ParserMessages : public google::protobuf::io::ErrorCollector {
 public:
  ParserMessages(Mistakes& mistakes, std::string place, std::optional<Rows> rows)
      : mistakes_(mistakes), place_(std::move(place)), rows_(rows) {}

  void AddError(int line, int column, const std::string& sentence) override { add(line, column, sentence); }
  void AddWarning(int line, int column, const std::string& sentence) override { add(line, column, sentence); }

 private:
  struct Explained {
    std::string sentence;
    std::string culprit;  // the word at fault, where the parser only noticed at the word after it
  };

  void add(int line, int column, const std::string& sentence) {
    if (mistakes_.full()) return mistakes_.add("", "");  // only counted; finding its place would take time for each
    const auto [explanation, culprit] = explain(sentence);
    std::string at;
    if (rows_ && line >= 0) {
      at = Rows::describe(line, column);
      const std::size_t noticed = rows_->offset(line, column);
      const auto found = culprit.empty() ? culprit.npos : rows_->text().substr(0, noticed).rfind(culprit);
      if (found != culprit.npos) at = rows_->describe(found);
    }
    mistakes_.add(place_ + at, explanation);
  }

  static Explained explain(const std::string& sentence) {
    const auto& file = *scene::Scene::descriptor()->file();
    const std::string first = quoted(sentence, 0), second = quoted(sentence, 1);
    if (sentence.starts_with("Message type"))
      if (const Descriptor* message = file.pool()->FindMessageTypeByName(first))
        return {"there is no field '" + second + "' in " + message->name() + did_you_mean_field(second, *message),
                second};
    if (sentence.starts_with("Unknown enumeration value"))
      for (int i = 0; i < file.message_type_count(); ++i) {
        const auto* field = file.message_type(i)->FindFieldByName(second);
        if (field != nullptr && field->enum_type() != nullptr)
          return {field->name() + " cannot be '" + first + "'; give " + allowed_text(*field), first};
      }
    if (sentence.starts_with("Non-repeated field")) return {first + " is given twice", first};
    if (sentence.ends_with(", got: ")) return {sentence + "the end", ""};
    return {sentence, ""};
  }

  Mistakes& mistakes_;
  std::string place_;
  std::optional<Rows> rows_;
};

TextFormat::Parser strict_parser(ParserMessages& messages) {
  TextFormat::Parser parser;
  parser.RecordErrorsTo(&messages);
  parser.AllowUnknownField(true);
  parser.SetRecursionLimit(kMaxDepth);
  return parser;
}

// Only text may reach the parser, because its sentences quote their input.
const char* why_not_text(const std::string& bytes) {
  using Utf8 = boost::nowide::utf::utf_traits<char>;
  for (auto next = bytes.begin(); next != bytes.end();) {
    const auto point = Utf8::decode(next, bytes.end());
    if (!boost::nowide::utf::is_valid_codepoint(point)) return "is not UTF-8 text";
    if ((point < 0x20 && point != '\n' && point != '\r' && point != '\t') || point == 0x7f)
      return "is not text: it holds control characters";
  }
  return nullptr;
}

std::string read_text(const std::string& path) {
  if (std::filesystem::is_directory(path)) throw ConfigError(path + ": is a directory, not a scene file");
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) throw ConfigError(path + ": cannot be opened: " + std::strerror(errno));
  std::string text(kMaxBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) throw ConfigError(path + ": cannot be read: " + std::strerror(errno));
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text;
}

std::filesystem::path scene_directory() {
  const char* chosen = std::getenv("FARHAND_SCENES");
  return chosen != nullptr && *chosen != '\0' ? chosen : FARHAND_SCENE_DIRECTORY;
}

std::string find_scene(const std::string& name_or_path) {
  if (name_or_path.find('/') != std::string::npos || name_or_path.ends_with(kEnding)) return name_or_path;
  const auto path = scene_directory() / (name_or_path + kEnding);
  std::error_code ignored;
  if (!name_or_path.empty() && std::filesystem::exists(path, ignored)) return path.string();
  const std::vector<std::string> names = known_scenes();
  const std::string hint = did_you_mean(name_or_path, names);
  std::string sentence = "there is no scene '" + name_or_path + "' in " + scene_directory().string() +
                         (hint.empty() ? "." : hint) + (names.empty() ? "" : " Known scenes:");
  for (const std::string& name : names) sentence += " " + name;
  throw ConfigError(sentence);
}

// One step of the path of a --set: a name and, for lists, an index.
struct Step {
  std::string name;
  std::optional<int> index;
};

std::optional<Step> read_step(const std::string& text) {
  const auto bracket = text.find('[');
  Step step{text.substr(0, bracket), {}};
  if (bracket == std::string::npos) return step;
  int index = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + bracket + 1, end, index);
  if (error != std::errc{} || rest + 1 != end || *rest != ']' || index < 0) return {};
  step.index = index;
  return step;
}

// One --set (or --seed): finds the field, then parses the value into an empty message of the same type, so that a value
// that smuggles in a second field or gives one twice is seen.
class Override {
 public:
  Override(std::string place, Mistakes& mistakes, Places& places)
      : place_(std::move(place)), mistakes_(mistakes), places_(places) {}

  void apply(const std::string& set, Message& scene) {
    const auto equals = set.find('=');
    if (equals == std::string::npos || equals == 0) return complain("must be field.path=value");
    descend(scene, set.substr(0, equals), set.substr(equals + 1), "");
  }

 private:
  void complain(const std::string& sentence) { mistakes_.add(place_, sentence); }

  void descend(Message& message, const std::string& path, const std::string& value, const std::string& done) {
    const auto dot = path.find('.');
    const std::optional<Step> step = read_step(path.substr(0, dot));
    if (!step) return complain("'" + path.substr(0, dot) + "' is not a field; an element of a list is written name[0]");
    const FieldDescriptor* field = message.GetDescriptor()->FindFieldByName(step->name);
    if (field == nullptr)
      return complain("there is no field '" + step->name + "' in " + message.GetDescriptor()->name() +
                      did_you_mean_field(step->name, *message.GetDescriptor()));
    if (step->index && !field->is_repeated()) return complain(done + step->name + " is not a list");

    // In a list an index one behind the last, or none, appends an element.
    const auto& reflection = *message.GetReflection();
    const int size = field->is_repeated() ? reflection.FieldSize(message, field) : 0;
    if (step->index && *step->index > size)
      return complain(done + step->name + " has " + std::to_string(size) + " elements; the next one to add is [" +
                      std::to_string(size) + "]");
    const int index = step->index.value_or(size);
    const std::string here = done + step->name + (field->is_repeated() ? "[" + std::to_string(index) + "]" : "");
    if (dot == std::string::npos) return assign(message, *field, index, value, here);
    if (field->message_type() == nullptr) return complain(done + step->name + " has no fields of its own");
    if (field->is_repeated() && !step->index)
      return complain(done + step->name + " is a list; say which element, such as " + step->name + "[0]");

    // Go on in the group of this field, which is made if it is absent.
    const bool appended = field->is_repeated() && index == size;
    Message* nested = !field->is_repeated() ? reflection.MutableMessage(&message, field)
                      : appended            ? reflection.AddMessage(&message, field)
                                            : reflection.MutableRepeatedMessage(&message, field, index);
    if (appended) places_.overwrite(here, place_);
    descend(*nested, path.substr(dot + 1), value, here + ".");
  }

  void assign(Message& message, const FieldDescriptor& field, int index, const std::string& value,
              const std::string& here) {
    // Parse into an empty message, which shows whether the value sets exactly this field.
    const std::unique_ptr<Message> fresh(message.New());
    ParserMessages messages(mistakes_, place_, {});
    if (!strict_parser(messages).ParseFromString(field.name() + ": " + value, fresh.get())) return;
    const auto& reflection = *message.GetReflection();
    std::vector<const FieldDescriptor*> given;
    reflection.ListFields(*fresh, &given);
    if (given.size() != 1 || (field.is_repeated() && reflection.FieldSize(*fresh, &field) != 1))
      return complain("must give one value for one field");
    // Merging appends to a list; the new element then replaces the one at the index.
    if (!field.is_repeated()) reflection.ClearField(&message, &field);
    message.MergeFrom(*fresh);
    if (field.is_repeated() && index + 1 < reflection.FieldSize(message, &field)) {
      reflection.SwapElements(&message, &field, index, reflection.FieldSize(message, &field) - 1);
      reflection.RemoveLast(&message, &field);
    }
    places_.overwrite(here, place_);
  }

  std::string place_;
  Mistakes& mistakes_;
  Places& places_;
};

class ShortestNumbers : public TextFormat::FastFieldValuePrinter {
 public:
  void PrintDouble(double value, TextFormat::BaseTextGenerator* generator) const override {
    generator->PrintString(shortest(value));
  }
};

}  // namespace

std::vector<std::string> known_scenes() {
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(scene_directory(), error), end; !error && entry != end;
       entry.increment(error))
    if (entry->path().extension() == kEnding) names.push_back(entry->path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

LoadedScene load_scene(const std::string& name_or_path, std::span<const std::string> sets,
                       std::optional<std::uint64_t> seed) {
  const std::string path = find_scene(name_or_path);
  return load_scene_text(read_text(path), path, sets, seed);
}

LoadedScene load_scene_text(const std::string& text, const std::string& path, std::span<const std::string> sets,
                            std::optional<std::uint64_t> seed) {
  if (text.size() > kMaxBytes) throw ConfigError(path + ": is larger than 1 MiB, so it is not a scene file");
  if (const char* why = why_not_text(text)) throw ConfigError(path + ": " + why);
  // Parse, with the place of every field for the sentences about mistakes.
  LoadedScene loaded{{}, std::filesystem::path(path).stem().string(), path};
  Mistakes mistakes;
  TextFormat::ParseInfoTree tree;
  ParserMessages messages(mistakes, path, Rows(text));
  TextFormat::Parser parser = strict_parser(messages);
  parser.WriteLocationsTo(&tree);
  if (!parser.ParseFromString(text, &loaded.scene)) {
    mistakes.throw_if_any();
    throw ConfigError(path + ": cannot be read as a scene");
  }

  // Settings of the command line come before the checks, so that they can also correct the file.
  Places places(path);
  places.add_tree(loaded.scene, tree);
  for (const std::string& set : sets) {
    if (const char* why = why_not_text(set))
      mistakes.add("--set", std::string("the argument ") + why);
    else
      Override("--set " + set, mistakes, places).apply(set, loaded.scene);
  }
  if (seed) {
    loaded.scene.set_seed(*seed);
    places.overwrite("seed", "--seed " + std::to_string(*seed));
  }
  // Defaults, ranges and contradictions; all mistakes are reported at once.
  for (const Complaint& complaint : complete_and_check(loaded.scene))
    mistakes.add(places.find(complaint.path), complaint.sentence);
  mistakes.throw_if_any();
  return loaded;
}

std::string complete_text(const scene::Scene& scene) {
  TextFormat::Printer printer;
  printer.SetDefaultFieldValuePrinter(new ShortestNumbers);  // the printer owns it
  std::string text;
  printer.PrintToString(scene, &text);
  return text;
}

}  // namespace farhand
