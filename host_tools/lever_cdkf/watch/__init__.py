"""The estimator watched while it runs: in a terminal (`lever monitor`) and on a page in a browser (`lever live`).

sources.py    where frames come from: a bus, a recorded log at its own pace, or a simulation; they wait here, bounded
picture.py    the state of the estimator as its frames say it: last values, their age, and a bounded history
mapped.py     sources with other messages: the firmware in this process estimates from mapped signals
paired.py     coherence of theta and z̈, from the samples of the last seconds
status.py     modes and faults in words
panels.py     the picture as tables of text
terminal.py   the tables in a terminal, ten times a second;  once.py: once, as plain text
transfer.py   θ/z̈ of the estimated model with its band
state.py      what the page shows, as JSON
server.py     the page and its WebSocket
page/         the page
"""
