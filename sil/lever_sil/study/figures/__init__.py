"""Figures for print and for a browser, from one command: `lever figures`.

Each figure is computed from runs of the firmware and described once (`description`), its caption included; `printed`
and `figures_page` draw what is described, for print and for a browser, `data` writes it as a table. `catalogue` lists
the figures, `runs` is what they share.

    {catalogue → one module for each group of figures → {runs, description}, printed, figures_page, data → description}

`maps` are figures of another kind, which `lever campaign` makes; those three take them, too.

A new figure: a function like those, and a line in `catalogue.FIGURES`.
"""
