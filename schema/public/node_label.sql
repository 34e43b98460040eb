-- description: The name of a node, or of its process in brackets where the node is not known.
-- param: full_name VARCHAR  Full name of the node; NULL: not known
-- param: process_name VARCHAR  Name of its process
-- param: pid INTEGER  Id of its process; NULL: then the result is NULL without a node
CREATE OR REPLACE MACRO main.node_label(full_name, process_name, pid) AS
coalesce(full_name, printf('[%s %d]', coalesce(process_name, '?'), pid))
