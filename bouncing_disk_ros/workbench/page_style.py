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
  function say(control, attribute, text) {
    if (control.getAttribute(attribute) != text) control.setAttribute(attribute, text);
  }
  function nameControls(root) {
    const name = root.querySelector(".bk-slider-title, label")?.textContent.split(":")[0];
    for (const one of root.querySelectorAll(".noUi-handle")) say(one, "aria-label", name);
    for (const way of ["up", "down"])
      for (const one of root.querySelectorAll(`.bk-spin-btn-${way}`))
        say(one, "aria-label", `${name} ${way}`);
    for (const one of root.querySelectorAll(".bk-tab")) {
      say(one.parentNode, "role", "tablist");
      say(one, "role", "tab");
      say(one, "aria-selected", one.classList.contains("bk-active"));
    }
    for (const one of root.querySelectorAll("*")) if (one.shadowRoot) nameControls(one.shadowRoot);
  }
  setInterval(() => nameControls(document), 1000);  // panes and titles come and change
</script>
{% endblock %}
"""
"""A phone shows the page in its own width; a browser that wishes dark pages gets one, with the hues
of the light one. Arrow keys choose a tab, which Bokeh lets only a pointer do. Screen readers hear
the names of sliders, their buttons and tabs, which Bokeh does not tell them."""

GOOD, BAD, USUAL = "#00704f", "#b00020", "#444"
"""Colours of texts, on white."""
_CONTROLS = """
:host { --primary: #2a6596; --primary-hover: #225681; }
:focus-visible { outline: 2px solid #0b57d0 !important; outline-offset: 1px !important; }
"""
"""Of each control, which has a style sheet of its own. Bokeh's focus is a pale dotted line, and its
white on blue has a contrast of 3.6."""

_GROUP = ".bk-btn { padding: 6px }"
_TABS = """
:host(.bk-above) { grid-template-columns: minmax(0, 1fr) }
:host > [style*="visibility: hidden"] { height: 0; overflow: hidden }
"""
"""No tab is wider than the page, and each is as high as what it shows: Bokeh's are as wide and high
as the largest of all."""

THEME = Theme(
    json={
        "attrs": {
            "LayoutDOM": {"stylesheets": [_CONTROLS]},
            "Toolbar": {"stylesheets": [_CONTROLS]},
            "Tabs": {"stylesheets": [_CONTROLS, _TABS]},
            "Slider": {"margin": (0, 9)},
            "InputWidget": {"margin": (0, 5)},
            "AbstractButton": {"margin": (3, 5)},
            "ToggleButtonGroup": {"stylesheets": [_CONTROLS, _GROUP], "margin": (3, 5)},
        }
    }
)
"""What all parts of the page have in common."""


def one_column(direction: str = "column") -> str:
    """Style of a row whose parts stand below each other on a narrow screen."""
    parts = f":host {{ flex-direction: {direction}; }} :host > * {{ flex: none; }}"
    return f"@media (max-width: 700px) {{ {parts} }}"
