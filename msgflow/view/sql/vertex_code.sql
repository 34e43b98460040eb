-- description: The kinds of things that flows pass, as bars of the timeline have them.
-- grain: one row per kind
-- kind: inline
-- column: name VARCHAR  'callback_instance', 'publication', 'take', 'request' or 'response'
-- column: code UTINYINT  As in bar.sql
SELECT
    unnest(['callback_instance', 'publication', 'take', 'request', 'response']) AS name,
    unnest([0, 1, 2, 3, 4])::UTINYINT AS code
