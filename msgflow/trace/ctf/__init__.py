"""msgflow's own decoder of CTF 1.8 and CTF 2, on numpy and pyarrow alone.

Metadata becomes a tree of types (`tsdl`, `json_metadata`); the stream files become a table of
packets (`packets`). Packets are read in batches in order of time. A scan finds where each event
begins, the only step that must go from event to event (`scan`); after it everything is a gather
over all events of one class (`gather`).
"""
