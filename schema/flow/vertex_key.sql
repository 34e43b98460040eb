-- description: One number for a vertex of a flow, so that walking over millions of them compares
--     and keeps numbers only.
CREATE OR REPLACE MACRO derive.vertex_key(kind, id) AS
8 * id
+ CASE kind
    WHEN 'publication' THEN 0
    WHEN 'take' THEN 1
    WHEN 'callback_instance' THEN 2
    WHEN 'request' THEN 3
    WHEN 'response' THEN 4
END
