// the page that a person reads
#include <fmt/format.h>

#include <cmath>

#include "escape.h"
#include "nido/report/report.h"

namespace nido {

namespace {

constexpr const char* kStyle = R"(
:root { --ink: #1d2430; --dim: #667; --line: #dde2e8; --good: #1a7f4b; --bad: #b3361e; --paper: #fff; --back: #f4f6f8; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--back); color: var(--ink); font: 16px/1.5 system-ui, sans-serif; }
main { max-width: 1000px; margin: 0 auto; padding: 24px 16px 60px; }
h1 { margin: 0 0 4px; font-size: 26px; } h2 { margin: 36px 0 10px; font-size: 19px; }
.dim { color: var(--dim); font-size: 14px; }
.banner { border-radius: 10px; padding: 16px 20px; margin: 18px 0; color: #fff; font-size: 19px; }
.good { background: var(--good); } .bad { background: var(--bad); }
.card { background: var(--paper); border: 1px solid var(--line); border-radius: 10px; padding: 12px 16px; margin: 10px 0; }
table { border-collapse: collapse; width: 100%; background: var(--paper); font-size: 14px; }
th, td { text-align: left; padding: 6px 10px; border-bottom: 1px solid var(--line); }
th { color: var(--dim); font-weight: 600; } td.number { text-align: right; font-variant-numeric: tabular-nums; }
.scroll { overflow-x: auto; border: 1px solid var(--line); border-radius: 10px; }
ol.story { list-style: none; margin: 0; padding: 0; }
ol.story li { display: grid; grid-template-columns: 76px 92px 1fr; gap: 8px; padding: 8px 0; border-bottom: 1px solid var(--line); }
.time { color: var(--dim); font-variant-numeric: tabular-nums; text-align: right; }
.stage { font-weight: 600; } .failed .stage, .failed .text { color: var(--bad); } .done .stage { color: var(--good); }
.pictures { display: flex; flex-wrap: wrap; gap: 8px; margin-top: 6px; }
figure { margin: 0; } figure img { max-width: 100%; width: 290px; border-radius: 6px; display: block; background: #ccc; }
figcaption { color: var(--dim); font-size: 12px; }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(400px, 1fr)); gap: 12px; }
code { background: #e8ecf0; padding: 1px 5px; border-radius: 4px; }
)";

std::string short_number(double value) {
  if (!std::isfinite(value)) return "-";
  return fmt::format("{:.4g}", value);
}

std::string picture_html(const Picture& picture) {
  return fmt::format(
      "<figure><a href=\"{0}\"><img src=\"{0}\" alt=\"{1}\" "
      "loading=\"lazy\"></a><figcaption>{1}</figcaption></figure>",
      escape_html(picture.file), escape_html(picture.caption));
}

std::string metrics_html(const std::vector<std::pair<std::string, Metric>>& metrics) {
  bool any_paper = false;
  for (const auto& [name, metric] : metrics) any_paper = any_paper || metric.paper.has_value();
  std::string html = fmt::format(
      "<div class=\"scroll\"><table><tr><th>metric</th><th>value</th><th>unit</th><th>95 % "
      "interval</th><th>n</th>{}"
      "</tr>\n",
      any_paper ? "<th>paper</th>" : "");
  for (const auto& [name, metric] : metrics) {
    const std::string range = metric.ci95 && std::isfinite((*metric.ci95)[0])
                                  ? short_number((*metric.ci95)[0]) + " to " + short_number((*metric.ci95)[1])
                                  : "";
    html += fmt::format(
        "<tr><td>{}</td><td class=\"number\">{}</td><td>{}</td><td>{}</td><td "
        "class=\"number\">{}</td>{}</tr>\n",
        escape_html(name), short_number(metric.value), escape_html(metric.unit), range, metric.n,
        any_paper
            ? fmt::format("<td class=\"number\">{}</td>", metric.paper ? short_number(*metric.paper) : "")
            : "");
  }
  return html + "</table></div>\n";
}

std::string cell_html(const Cell& cell) {
  if (const auto* flag = std::get_if<bool>(&cell)) return fmt::format("<td>{}</td>", *flag ? "yes" : "no");
  if (const auto* value = std::get_if<double>(&cell)) {
    return fmt::format("<td class=\"number\">{}</td>", short_number(*value));
  }
  return fmt::format("<td>{}</td>", escape_html(std::get<std::string>(cell)));
}

std::string trials_html(const std::vector<Row>& rows) {
  std::string html = "<div class=\"scroll\"><table><tr>";
  for (const auto& [key, cell] : rows.front()) html += fmt::format("<th>{}</th>", escape_html(key));
  html += "</tr>\n";
  for (const Row& row : rows) {
    html += "<tr>";
    for (const auto& [key, cell] : row) html += cell_html(cell);
    html += "</tr>\n";
  }
  return html + "</table></div>\n";
}

std::string story_html(const std::vector<StoryLine>& story) {
  std::string html = "<div class=\"card\"><ol class=\"story\">\n";
  for (const StoryLine& line : story) {
    std::string pictures;
    for (const Picture& picture : line.pictures) pictures += picture_html(picture);
    html += fmt::format(
        "<li class=\"{}\"><span class=\"time\">{:.2f} s</span><span class=\"stage\">{}</span><span "
        "class=\"text\">{}{}</span></li>\n",
        escape_html(line.state), line.time_s, escape_html(line.stage), escape_html(line.text),
        pictures.empty() ? "" : "<div class=\"pictures\">" + pictures + "</div>");
  }
  return html + "</ol></div>\n";
}

std::string part_html(const ReportPart& part) {
  std::string html = fmt::format("<h2>{}</h2>\n", escape_html(part.title));
  if (!part.summary.empty()) html += fmt::format("<p>{}</p>\n", escape_html(part.summary));
  html += fmt::format("<p class=\"dim\"><a href=\"{}\">whole report</a>, made by <code>{}</code></p>\n",
                      escape_html(part.page), escape_html(part.command));
  if (!part.metrics.empty()) html += metrics_html(part.metrics);
  if (!part.pictures.empty()) {
    html += "<div class=\"pictures\">\n";
    for (const Picture& picture : part.pictures) html += picture_html(picture) + "\n";
    html += "</div>\n";
  }
  return html;
}

}  // namespace

std::string escape_html(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string Report::to_html() const {
  const std::string heading = escape_html(title.empty() ? name : title);
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\"><title>{} - "
      "nido</title><style>{}</style></head><body><main>\n"
      "<h1>{}</h1>\n",
      heading, kStyle, heading);

  std::vector<std::string> facts = {fmt::format("seed {}", seed)};
  if (trials != 1) facts.push_back(fmt::format("{} trials", trials));
  if (!robot.empty()) facts.push_back("robot " + escape_html(robot));
  if (!world.empty()) facts.push_back("world " + escape_html(world));
  facts.push_back(fmt::format("{:.1f} s of wall time", wall_s));
  if (sim_s > 0.0) facts.push_back(fmt::format("{:.1f} s of simulated time", sim_s));
  html += fmt::format("<div class=\"dim\">{}</div>\n", fmt::join(facts, " &middot; "));

  if (outcome) {
    html += fmt::format("<div class=\"banner {}\">{}</div>\n", outcome->success ? "good" : "bad",
                        escape_html(outcome->sentence));
  }
  if (!summary.empty()) html += fmt::format("<p>{}</p>\n", escape_html(summary));
  if (!command.empty()) {
    html += fmt::format("<p class=\"dim\">Made by <code>{}</code></p>\n", escape_html(command));
  }
  if (!story.empty()) html += "<h2>What happened</h2>\n" + story_html(story);
  if (!metrics.empty()) html += "<h2>Metrics</h2>\n" + metrics_html(metrics);
  if (!plots.empty()) {
    html += "<h2>Plots</h2>\n<div class=\"plots\">\n";
    for (const Plot& plot : plots) html += "<div class=\"card\">" + plot_svg(plot) + "</div>\n";
    html += "</div>\n";
  }
  if (!pictures.empty()) {
    html += "<h2>Pictures</h2>\n<div class=\"pictures\">\n";
    for (const Picture& picture : pictures) html += picture_html(picture) + "\n";
    html += "</div>\n";
  }
  for (const ReportPart& part : parts) html += part_html(part);
  if (!trials_detail.empty()) html += "<h2>Trials</h2>\n" + trials_html(trials_detail);
  if (!processes.empty()) {
    html += "<h2>Processes</h2>\n<div class=\"scroll\"><table><tr><th>process</th><th>restarts</th></tr>\n";
    for (const ProcessRecord& process : processes) {
      html += fmt::format("<tr><td>{}</td><td class=\"number\">{}</td></tr>\n", escape_html(process.name),
                          process.restarts);
    }
    html += "</table></div>\n";
  }
  html += "<h2>Versions</h2>\n<p class=\"dim\">";
  auto all_versions = versions;
  all_versions.merge(standard_versions());
  for (const auto& [what, version] : all_versions) {
    html += fmt::format("{} {}<br>\n", escape_html(what), escape_html(version));
  }
  return html + "</p>\n</main></body></html>\n";
}

}  // namespace nido
