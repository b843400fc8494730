// Descriptions of the fields of scene.proto, as sentences: for the loader's complaints, for `farhand-lab schema` and
// for tools (JSON).
#pragma once

#include <google/protobuf/descriptor.h>

#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

#include "proto/scene.pb.h"

namespace farhand {

const scene::FieldInfo& field_info(const google::protobuf::FieldDescriptor& field);

// True if the field stays absent unless it is given, such as the patient's hand.
bool may_stay_absent(const google::protobuf::FieldDescriptor& field);

// "a value from 0 to 1e6 N m/rad", "one of LIGHT, NORMAL, FIRM, CUSTOM".
std::string allowed_text(const google::protobuf::FieldDescriptor& field);

// ", did you mean 'X'?" with the candidate that is closest in spelling, or nothing if none is close.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);
std::string did_you_mean_field(std::string_view word, const google::protobuf::Descriptor& message);

// The shortest text that reads back as the same number, whatever the locale.
std::string shortest(double number);

// Every field with its path (as --set takes it), type, unit, range, default and meaning.
void print_schema(std::ostream& out);
void print_schema_json(std::ostream& out);

// A value as a scene has it. path: names joined by dots, of no list. std::invalid_argument if there is none.
std::string value_text(const google::protobuf::Message& message, const google::protobuf::FieldDescriptor& field);
std::string value_text(const scene::Scene& scene, std::string_view path);

}  // namespace farhand
