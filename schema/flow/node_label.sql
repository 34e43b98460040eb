-- name: derive.node_label
-- kind: macro
-- description: The name of a node, or of its process in brackets where the node is not known.
CREATE OR REPLACE MACRO derive.node_label(full_name, process_name, pid) AS
coalesce(full_name, printf('[%s %d]', coalesce(process_name, '?'), pid))
