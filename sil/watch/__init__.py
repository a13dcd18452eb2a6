"""`lever monitor` and `lever live`: a bus, a recorded log or a simulation watched while it runs.

    commands.py     the two commands
    simulation.py   a scenario in real time, with the estimator in the loop, as a source of frames
    transfer.py     θ/z̈ of the estimated model with its band
    state.py        what the page is told, as JSON
    server.py       the page and its WebSocket
    page/           the page

The picture itself and the view in a terminal are in host_tools/watch.
"""
