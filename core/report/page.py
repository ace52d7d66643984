"""The page around a report's sections: its head, its looks, its foot."""

import demsmith
from demsmith.core.report.markup import Markup, element

# Plain enough for QGIS's own viewer, whose browser is ten years old: no grid, no variables.
_STYLE = Markup("""
html { background: #f4f3f0; color: #22252a; }
body { font: 15px/1.55 "Segoe UI", "Helvetica Neue", "Noto Sans", "DejaVu Sans", Arial, sans-serif;
  max-width: 1080px; margin: 0 auto; padding: 28px 24px 48px; }
h1 { font-size: 29px; line-height: 1.2; font-weight: 600; letter-spacing: -0.01em; margin: 0; }
h2 { font-size: 19px; font-weight: 600; margin: 0 0 14px; }
header { border-left: 5px solid #d6186f; padding-left: 16px; margin-bottom: 24px; }
header p { margin: 4px 0 0; color: #5a6069; overflow-wrap: anywhere; word-wrap: break-word; }
section { background: #ffffff; border: 1px solid #e2e0da; border-radius: 8px;
  padding: 20px 22px; margin: 0 0 18px; }
section > :last-child { margin-bottom: 0; }
p { margin: 0 0 12px; max-width: 78ch; }
.warning { border-left: 4px solid #c77700; padding: 6px 12px; background: #fff6e3; }
.numbers { display: -webkit-flex; display: flex; -webkit-flex-wrap: wrap; flex-wrap: wrap;
  margin: 0 -8px; }
.numbers > div { -webkit-flex: 1 1 150px; flex: 1 1 150px; min-width: 130px; margin: 0 8px 8px; }
.numbers dt { font-size: 13px; color: #5a6069; }
.numbers dd { margin: 0; }
.numbers .value { font-size: 25px; line-height: 1.25; font-weight: 600; white-space: nowrap; }
.numbers .note { font-size: 12.5px; color: #5a6069; line-height: 1.35; }
figure { margin: 0 0 16px; }
figcaption { font-size: 13px; color: #5a6069; margin-top: 6px; max-width: 78ch; }
img { display: block; width: 100%; height: auto; border-radius: 4px; }
.gallery { display: -webkit-flex; display: flex; -webkit-flex-wrap: wrap; flex-wrap: wrap;
  margin: 0 -8px; }
.gallery figure { margin: 0 8px 16px; }
.of-2 figure { width: calc(50% - 16px); }
.of-4 figure { width: calc(25% - 16px); }
svg { max-width: 100%; height: auto; }
svg text { font-size: 12px; fill: currentColor; font-family: inherit; }
.legend { list-style: none; margin: 6px 0; padding: 0; font-size: 13px; }
.legend li { display: inline-block; margin: 0 16px 2px 0; }
.legend svg { margin-right: 6px; vertical-align: -1px; }
.ramp { display: block; margin: 4px 0 0; }
.ramp svg { vertical-align: -1px; margin: 0 6px; }
.scroll { overflow-x: auto; margin: 0 0 16px; }
table { border-collapse: collapse; font-size: 13.5px; }
caption { text-align: left; font-size: 13px; color: #5a6069; padding-bottom: 6px; }
th, td { text-align: left; vertical-align: top; padding: 5px 14px 5px 0;
  border-bottom: 1px solid #e8e6e0; }
thead th { font-weight: 600; border-bottom: 2px solid #cfccc4; vertical-align: bottom; }
th.number { text-align: right; }
td.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
td.best { color: #0b7a43; }
.facts th { font-weight: 400; color: #5a6069; white-space: nowrap; }
.facts td { overflow-wrap: anywhere; word-wrap: break-word; }
footer { font-size: 12.5px; color: #5a6069; }
@media (max-width: 760px) {
  .of-2 figure { width: 100%; }
  .of-4 figure { width: calc(50% - 16px); }
}
@media (prefers-color-scheme: dark) {
  html { background: #17191c; color: #e6e4df; }
  section { background: #1f2226; border-color: #33373d; }
  header p, figcaption, caption, footer, .numbers dt, .numbers .note, .facts th { color: #a3a9b2; }
  th, td { border-color: #33373d; }
  thead th { border-color: #4a4f57; }
  td.best { color: #55cf95; }
  .warning { background: #3a2f17; }
}
@media print {
  html { background: #ffffff; }
  body { max-width: none; padding: 0; }
  section { border: none; padding: 0; page-break-inside: avoid; }
}
""")


def page(report):
    """Write a report as one HTML page.

    Parameters
    ----------
    report : demsmith.core.report.Report

    Returns
    -------
    str
    """
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", name="color-scheme", content="light dark"),
        element("title", report.title),
        element("style", _STYLE),
    )
    body = element(
        "body",
        element("header", element("h1", report.title), element("p", report.subtitle)),
        element("main", (section.markup() for section in report.sections)),
        element("footer", f"Made by Demsmith {demsmith.__version__}."),
    )
    return "<!DOCTYPE html>\n" + element("html", head, "\n", body, lang="en") + "\n"
