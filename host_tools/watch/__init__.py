"""The estimator watched while it runs: what both the view in a terminal and the page in a browser are made of.

    sources.py   where frames come from: a bus, or a recorded log at its own pace; they wait here, bounded, to be taken
    traffic.py   rates and losses of one message
    model.py     the picture of the estimator that its frames make, with a bounded history
    words.py     modes and faults in words
    panels.py    the picture as tables of text
    terminal.py  the tables in a terminal, ten times a second

    state.py server.py transfer.py page/   the page that `lever live` serves
"""
