"""How the page looks and takes keys: its HTML template, and the style of all its controls."""

from __future__ import annotations

from bokeh.themes import Theme

TEMPLATE = """
{% block preamble %}
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
  @media (prefers-color-scheme: dark) {
    html { background: white; filter: invert(0.95) hue-rotate(180deg); }
  }
</style>
<script>
  document.addEventListener("keydown", event => {
    const at = event.composedPath()[0];
    if (!at.classList?.contains("bk-tab")) return;
    const tab = { ArrowLeft: at.previousElementSibling, ArrowRight: at.nextElementSibling,
                  Enter: at, " ": at }[event.key];
    if (!tab) return;
    event.preventDefault();
    tab.focus();
    tab.click();
  });
</script>
{% endblock %}
"""
"""A phone shows the page in its own width; a browser that wishes dark pages gets one, with the hues
of the light one. Arrow keys choose a tab, which Bokeh lets only a pointer do."""

GOOD, BAD, USUAL = "#00704f", "#b00020", "#444"
"""Colours of texts, on white."""
_CONTROLS = """
:host { --primary: #2a6596; --primary-hover: #225681; }
:focus-visible { outline: 2px solid #0b57d0 !important; outline-offset: 1px !important; }
"""
"""Of each control, which has a style sheet of its own. Bokeh's focus is a pale dotted line, and its
white on blue has a contrast of 3.6."""

THEME = Theme(
    json={"attrs": {name: {"stylesheets": [_CONTROLS]} for name in ("LayoutDOM", "Toolbar")}}
)
"""What all parts of the page have in common."""
