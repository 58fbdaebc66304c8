// SPDX-License-Identifier: Apache-2.0
#include "evaluation/result.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {

using nlohmann::json;

namespace {

template <class T, class Write>
json OrNull(const std::optional<T>& value, Write&& write) {
  return value ? json(write(*value)) : json();
}

json NumberOrNull(const std::optional<double>& value) {
  return OrNull(value, [](double number) { return number; });
}

// Counts are whole numbers, their means are not.
json Count(double value) { return value == std::floor(value) ? json(std::size_t(value)) : json(value); }

// {"0.01": value}
template <class T, class Write>
json ByThreshold(const std::map<double, T>& values, Write&& write) {
  json object = json::object();
  for (const auto& [threshold, value] : values) object[fmt::format("{:g}", threshold)] = write(value);
  return object;
}

json ToJson(const ErrorFigures& figures) {
  return {{"mean", NumberOrNull(figures.mean)},
          {"median", NumberOrNull(figures.median)},
          {"within", ByThreshold(figures.within, [](double share) { return share; })}};
}

json ToJson(const PixelErrors& errors) {
  json object = ToJson(errors.estimated);
  object["over_all"] = ToJson(errors.all);
  return object;
}

json ToJson(const MapErrors& errors) {
  const auto write = [](const PixelErrors& each) { return ToJson(each); };
  json object = {{"object_pixels", Count(errors.object_pixels)},
                 {"completeness", errors.completeness},
                 {"beyond", errors.beyond},
                 {"depth", OrNull(errors.depth, write)}};
  if (errors.normal_deg) object["normal_degrees"] = ToJson(*errors.normal_deg);
  return object;
}

json ToJson(const std::optional<Curve>& curve) {
  return OrNull(curve, [](const Curve& c) { return json{{"end", c.end}, {"shares", c.shares}}; });
}

json ToJson(const MapsEvaluation& maps) {
  json per_view = json::object();
  for (const auto& [name, errors] : maps.per_view) per_view[name] = ToJson(errors);
  return {{"kind", maps.kind},
          {"views", maps.views},
          {"views_without_maps", maps.views_without_maps},
          {"unit", maps.unit},
          {"depth_penalty", maps.depth_penalty},
          {"normal_penalty", maps.normal_penalty_deg},
          {"mean", ToJson(maps.mean)},
          {"curves", {{"depth", ToJson(maps.depth)}, {"normal_degrees", ToJson(maps.normal_deg)}}},
          {"per_view", per_view}};
}

json ToJson(const std::optional<DistanceFigures>& figures) {
  return OrNull(figures, [](const DistanceFigures& f) {
    return json{{"mean", f.mean}, {"median", f.median}, {"rms", f.rms}, {"p90", f.p90}};
  });
}

json ToJson(const CloudEvaluation& cloud) {
  const auto shares = [](const CloudShares& s) {
    return json{{"precision", s.precision}, {"recall", s.recall}, {"F", s.f}};
  };
  return {{"points", cloud.points},
          {"points_of_surroundings", cloud.points_of_surroundings},
          {"points_cropped", cloud.points_cropped},
          {"samples", cloud.samples},
          {"visible_share", cloud.visible_share},
          {"area", cloud.area},
          {"sample_spacing", cloud.sample_spacing},
          {"unit", cloud.unit},
          {"cap", cloud.cap},
          {"accuracy", ToJson(cloud.accuracy)},
          {"completeness", ToJson(cloud.completeness)},
          {"thresholds", ByThreshold(cloud.within, shares)},
          {"curves",
           {{"accuracy", ToJson(cloud.accuracy_curve)}, {"completeness", ToJson(cloud.completeness_curve)}}}};
}

// The value at `key`, read by `read`; none if it is absent or null.
template <class Read>
auto Optional(const json& object, const char* key, Read&& read)
    -> std::optional<decltype(read(std::declval<const json&>()))> {
  const auto found = object.find(key);
  if (found == object.end() || found->is_null()) return std::nullopt;
  return read(*found);
}

double ReadNumber(const json& value) { return value.get<double>(); }

template <class Read>
auto ReadByThreshold(const json& object, Read&& read) {
  std::map<double, decltype(read(std::declval<const json&>()))> values;
  for (const auto& [threshold, value] : object.items()) values[std::stod(threshold)] = read(value);
  return values;
}

ErrorFigures ReadFigures(const json& object) {
  return {Optional(object, "mean", ReadNumber), Optional(object, "median", ReadNumber),
          ReadByThreshold(object.at("within"), ReadNumber)};
}

PixelErrors ReadPixelErrors(const json& object) {
  return {ReadFigures(object), ReadFigures(object.at("over_all"))};
}

MapErrors ReadMapErrors(const json& object) {
  return {object.at("object_pixels"), object.at("completeness"), object.at("beyond"),
          Optional(object, "depth", ReadPixelErrors), Optional(object, "normal_degrees", ReadPixelErrors)};
}

Curve ReadCurve(const json& object) { return {object.at("end"), object.at("shares")}; }

MapsEvaluation ReadMapsEvaluation(const json& object) {
  MapsEvaluation maps{object.at("kind"),
                      object.at("views"),
                      object.at("views_without_maps"),
                      object.at("unit"),
                      object.at("depth_penalty"),
                      object.at("normal_penalty"),
                      ReadMapErrors(object.at("mean")),
                      Optional(object.at("curves"), "depth", ReadCurve),
                      Optional(object.at("curves"), "normal_degrees", ReadCurve),
                      {}};
  for (const auto& [name, errors] : object.at("per_view").items())
    maps.per_view[name] = ReadMapErrors(errors);
  return maps;
}

DistanceFigures ReadDistances(const json& object) {
  return {object.at("mean"), object.at("median"), object.at("rms"), object.at("p90")};
}

CloudShares ReadShares(const json& object) {
  return {object.at("precision"), object.at("recall"), object.at("F")};
}

CloudEvaluation ReadCloudEvaluation(const json& object) {
  return {object.at("points"),
          object.at("points_of_surroundings"),
          object.at("points_cropped"),
          object.at("samples"),
          object.at("visible_share"),
          object.at("area"),
          object.at("sample_spacing"),
          object.at("unit"),
          object.at("cap"),
          Optional(object, "accuracy", ReadDistances),
          Optional(object, "completeness", ReadDistances),
          ReadByThreshold(object.at("thresholds"), ReadShares),
          Optional(object.at("curves"), "accuracy", ReadCurve),
          Optional(object.at("curves"), "completeness", ReadCurve)};
}

ErrorLimits ReadLimits(const json& object) { return {object.at("depth"), object.at("normal")}; }

std::string ReadText(const json& value) { return value.get<std::string>(); }

}  // namespace

json ToJson(const Evaluation& evaluation) {
  json object = {{"input", evaluation.input}, {"truth", evaluation.truth}};
  if (evaluation.alignment) object["alignment"] = ToJson(*evaluation.alignment);
  if (evaluation.pictures)
    object["pictures"] = {{"depth", evaluation.pictures->depth}, {"normal", evaluation.pictures->normal_deg}};
  if (evaluation.maps) object["maps"] = ToJson(*evaluation.maps);
  if (evaluation.cloud) object["cloud"] = ToJson(*evaluation.cloud);
  if (evaluation.maps_result) object["maps_result"] = *evaluation.maps_result;
  if (!evaluation.cloud_hash.empty()) object["cloud_hash"] = evaluation.cloud_hash;
  return object;
}

Evaluation ReadEvaluation(const std::filesystem::path& file) {
  const json object = ReadJson(file);
  try {
    return {object.at("input"),
            object.at("truth"),
            Optional(object, "alignment", ReadAlignmentErrors),
            Optional(object, "pictures", ReadLimits),
            Optional(object, "maps", ReadMapsEvaluation),
            Optional(object, "cloud", ReadCloudEvaluation),
            Optional(object, "maps_result", ReadText),
            object.value("cloud_hash", "")};
  } catch (const std::exception&) {
    throw Error("this is no evaluation, or of another version", file.string(),
                "Run polarscan evaluate again");
  }
}

}  // namespace polarscan
