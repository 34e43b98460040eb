-- name: main.thread_label
-- kind: macro
-- description: The name of a thread: the nodes of its process, and its own name if that is not the
--     one of the process, as of threads of the middleware.
-- param: nodes VARCHAR  Nodes of its process, see main.process_label; NULL: then the result is NULL
-- param: process_name VARCHAR  Name of its process
-- param: thread_name VARCHAR  Its own name
CREATE OR REPLACE MACRO main.thread_label(nodes, process_name, thread_name) AS
nodes || coalesce(' ' || nullif(thread_name, process_name), '')
