"""Figures for print and for a browser, from one command: `lever figures`.

Each figure is computed from runs of the firmware and described once (`description`), its caption included. There is one
renderer for each medium: `plotted` for a browser (plotly.js), `printed` for print (matplotlib, from what `plotted`
makes), and `data` for a table. `figures_page` puts the figures on a page, `catalogue` lists them, `runs` is what they
share.

    {catalogue → one module for each group of figures → {runs, description},
     figures_page → plotted, printed → plotted, data → description}

`maps` describes figures of another kind, which `lever campaign` makes; the renderers take them, too. `printed` also
draws the charts of `lever compare`, which are made for a browser.

A new figure: a function like those, and a line in `catalogue.FIGURES`.
"""
