// SPDX-License-Identifier: Apache-2.0
// The camera's GenICam features: which it has, reading and setting them.
#pragma once
#include <arv.h>

#include <nlohmann/json.hpp>
#include <string>

namespace polarscan::aravis {

// Whether the camera has it, as it is set now.
bool HasFeature(ArvCamera* camera, const char* feature);

// The value as text; empty if the camera does not say.
std::string TextFeature(ArvCamera* camera, const char* feature);

// NaN if the camera does not say.
double FloatFeature(ArvCamera* camera, const char* feature);

// Throws Error if the camera does not say.
int IntegerFeature(ArvCamera* camera, const char* feature);

// {name: value} of those that are kept with a recording, as far as the camera has them.
nlohmann::json LoggedFeatures(ArvCamera* camera);

// Throws Error if there is no such feature or its value is not allowed.
void SetFeature(ArvCamera* camera, const std::string& feature, const std::string& value);

// Has the camera send these values with its pictures. names: separated by commas. Throws Error if it cannot.
void SwitchChunksOn(ArvCamera* camera, const std::string& names);

}  // namespace polarscan::aravis
