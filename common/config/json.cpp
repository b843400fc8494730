#include "common/config/json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

namespace farhand {

struct Json::Value {
  nlohmann::ordered_json of;
};

Json::Json() : value_(new Value) {}
Json::Json(Value value) : value_(new Value(std::move(value))) {}
Json::Json(bool value) : Json(Value{value}) {}
Json::Json(double value) : Json(std::isfinite(value) ? Value{value} : Value{}) {}
Json::Json(std::string_view value) : Json(Value{value}) {}
Json::Json(const std::vector<std::string>& values) : Json(Value{values}) {}
Json::Json(Whole, std::int64_t value) : Json(Value{value}) {}
Json::Json(Whole, std::uint64_t value) : Json(Value{value}) {}
Json Json::array() { return Json(Value{nlohmann::ordered_json::array()}); }

Json Json::object(Members members) {
  Json all(Value{nlohmann::ordered_json::object()});
  for (const auto& [key, value] : members) all.set(key, value);
  return all;
}

Json::Json(const Json& other) : Json(Value{*other.value_}) {}
Json::Json(Json&& other) noexcept = default;
Json& Json::operator=(Json other) noexcept {
  value_.swap(other.value_);
  return *this;
}
Json::~Json() = default;

void Json::set(std::string_view key, const Json& value) { value_->of[std::string(key)] = value.value_->of; }
void Json::push_back(const Json& value) { value_->of.push_back(value.value_->of); }

std::string Json::dump(int indent) const {
  return value_->of.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

Json Json::parse(const std::string& text) {
  nlohmann::ordered_json parsed = nlohmann::ordered_json::parse(text, nullptr, false);
  return parsed.is_discarded() ? Json() : Json(Value{std::move(parsed)});
}

Json Json::operator[](std::string_view key) const {
  return contains(key) ? Json(Value{value_->of.at(std::string(key))}) : Json();
}
Json Json::operator[](std::size_t index) const {
  return is_array() && index < size() ? Json(Value{value_->of.at(index)}) : Json();
}
std::size_t Json::size() const { return value_->of.size(); }
bool Json::contains(std::string_view key) const { return value_->of.contains(std::string(key)); }
bool Json::is_null() const { return value_->of.is_null(); }
bool Json::is_object() const { return value_->of.is_object(); }
bool Json::is_array() const { return value_->of.is_array(); }
std::string Json::text() const { return value_->of.is_string() ? value_->of.get<std::string>() : std::string(); }

std::vector<std::string> Json::keys() const {
  std::vector<std::string> found;
  if (!is_object()) return found;
  for (const auto& item : value_->of.items()) found.push_back(item.key());
  return found;
}

bool operator==(const Json& a, const Json& b) { return a.value_->of == b.value_->of; }
std::ostream& operator<<(std::ostream& out, const Json& value) { return out << value.dump(2); }

std::string valid_utf8(std::string_view text) { return Json::parse(Json(text).dump(-1)).text(); }

std::string json_library_version() {
  return std::to_string(NLOHMANN_JSON_VERSION_MAJOR) + "." + std::to_string(NLOHMANN_JSON_VERSION_MINOR) + "." +
         std::to_string(NLOHMANN_JSON_VERSION_PATCH);
}

}  // namespace farhand
