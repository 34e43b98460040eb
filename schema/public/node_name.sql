-- description: Namespace and name of a node, without the host or process behind it where nodes of
--     several processes have that name at a time (main.node).
-- param: full_name VARCHAR  Full name of the node
CREATE OR REPLACE MACRO main.node_name(full_name) AS split_part(full_name, '@', 1)
