// A JSON value. Only one source includes the library behind it, which costs each source that includes it five seconds.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iosfwd>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace farhand {

class Json {
 public:
  using Members = std::initializer_list<std::pair<std::string_view, Json>>;

  Json();  // null
  Json(bool value);
  Json(double value);  // null unless it is finite
  Json(std::string_view value);
  Json(const std::string& value) : Json(std::string_view(value)) {}
  Json(const char* value) : Json(std::string_view(value)) {}
  Json(const std::vector<std::string>& values);
  template <std::signed_integral T>
  Json(T value) : Json(Whole{}, static_cast<std::int64_t>(value)) {}
  template <std::unsigned_integral T>
  Json(T value) : Json(Whole{}, static_cast<std::uint64_t>(value)) {}
  static Json array();
  static Json object(Members members = {});

  Json(const Json& other);
  Json(Json&& other) noexcept;
  Json& operator=(Json other) noexcept;
  ~Json();

  // Members stand in the order in which they were first set. The value must be an object (or null, which becomes one).
  void set(std::string_view key, const Json& value);
  // The value must be an array (or null, which becomes one).
  void push_back(const Json& value);
  // Bytes that are not UTF-8 are replaced. indent: spaces per level.
  std::string dump(int indent) const;

  // Null if the text is no JSON.
  static Json parse(const std::string& text);

  // Copies; null where there is none.
  Json operator[](std::string_view key) const;
  Json operator[](const char* key) const { return (*this)[std::string_view(key)]; }
  Json operator[](std::size_t index) const;
  std::size_t size() const;
  std::vector<std::string> keys() const;  // of an object
  bool contains(std::string_view key) const;
  bool is_null() const;
  bool is_object() const;
  bool is_array() const;
  std::string text() const;  // empty if it is no string

  friend bool operator==(const Json& a, const Json& b);
  friend std::ostream& operator<<(std::ostream& out, const Json& value);

 private:
  struct Whole {};
  Json(Whole, std::int64_t value);
  Json(Whole, std::uint64_t value);

  struct Value;
  explicit Json(Value value);
  std::unique_ptr<Value> value_;
};

// The text with every byte that is not UTF-8 replaced.
std::string valid_utf8(std::string_view text);

// "3.11.2".
std::string json_library_version();

}  // namespace farhand
