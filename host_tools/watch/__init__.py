"""The estimator watched while it runs: what both the view in a terminal and the page in a browser are made of.

sources.py    where frames come from: a bus, a recorded log at its own pace, or a simulation; they wait here, bounded
model.py      the picture of the estimator that its frames make, with a bounded history
paired.py     coherence of theta and z̈ as they come
status.py     modes and faults in words
panels.py     the picture as tables of text
terminal.py   the tables in a terminal, ten times a second
transfer.py   θ/z̈ of the estimated model with its band
state.py      what the page shows, as JSON
server.py     the page and its WebSocket
page/         the page
"""
