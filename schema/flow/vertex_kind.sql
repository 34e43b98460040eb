-- description: The kind of a vertex from its number, whose eighth is its identity.
CREATE OR REPLACE MACRO derive.vertex_kind(vertex_key) AS
['publication', 'take', 'callback_instance', 'request', 'response'][vertex_key % 8 + 1]
