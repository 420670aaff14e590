#pragma once
#include <map>
#include <string>

// SHA-256 of the files of bytes_test.cpp, for each instruction set. Scene and fields were recorded at commit
// 07c747b; owners and all that is made with them, at the commit where `embed` began to draw a code for each
// image. AVX-512 is not recorded, for want of a machine that has it.
inline const std::map<std::string, std::string> kBytesV2{
    {"code baked field", "e26442e1977fc7c12dc57999b35e56c1cd15d9031d5d016972038d9b3c728518"},
    {"code logits", "0b84bf6eeb43dc3675d6a35f0929706c938ea9179ec5fa70e14b49738a6be61e"},
    {"code owner", "a21725e152f1d9e862fb4133486228e154a096ae4521dfb1e8a9dd1d55c1e35b"},
    {"code renders", "9a907db320b4130217845ba9208a200cd78e96eb059ccb7c6324e52cbcd31b8c"},
    {"fast baked field", "0af13305165ad95de70a1988da54d13e66d906c04c0acc45c0b72edf1d661673"},
    {"fast logits", "085e841d3e67e8d0ac2536ccd471354be30f101b15aff48364ca092aaf5905be"},
    {"fast owner", "94a698eb5b452832320ea3c6300a850b04e1fec3c9ce6816e4ea8959cd80e414"},
    {"fast renders", "a7f5e13b156882aa861bbc628a266ba7d4ffac397ed5c5d29418a3acb4416a5a"},
    {"hash field", "7169f1e7a7340da7cd7253b251b0cd4a79ddbae0180376de07068fb54e49625e"},
    {"mlp field", "7b33409f716c7056416cecc68cb45c617c9aca7da414de414f01d9eeff7cdb82"},
    {"paper baked field", "927d32a0f8b8baa184b3b12886b68d6ab51660e5b9dcc9fdaece4805ad4c6ba8"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "37101e8ea8cbe6414d1ac5aa525ececcbaeb0768f2cb1d13410382f0b8a06ec5"},
    {"paper renders", "5b4700a52f6f706bc85a1b522db6d43158d065c9d08e1c4256cc4854b7c57a10"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
inline const std::map<std::string, std::string> kBytesV3{
    {"code baked field", "1cdc848f3df0227d0c0ef51de8d801dcfec6196e2c4bc140fdfc43414d33229e"},
    {"code logits", "bef536936d53fef8b33037b6b6d0057e176e20bafcc7ad9fc1b07155e45d9de5"},
    {"code owner", "2d9b12e26fa68088a46aab72cfe03dd5d60c7529fd42493da18a20bb58f19cfd"},
    {"code renders", "b5805b6e29fa89b77facf7acbe863b45cbee2ae39f5a6e5bb5cb04f8dbc245e2"},
    {"fast baked field", "363a5e138c537421e733537874065599ad77e76e15aa30e5136d1da2737648c2"},
    {"fast logits", "e5affddc713e155355a66ace7b3276f543efabb73cfd5d41dd5183e092dcfabf"},
    {"fast owner", "ff5daa82123846341d035c0cfdd1d2f80c8044d3c240a85cd4c8664d0c83ef31"},
    {"fast renders", "aee3b7628c42fdf152f738fec7a28d823cc50e59203ceb7815c6d29e6c9e9a60"},
    {"hash field", "ddb8c16b2d62994a59ed8aa4ae932d923e75564baf99a3cbcda6591352018d07"},
    {"mlp field", "75b9aa11ccbf62dada9278d143ad378beee4521b95c4db7fe9702982666dee32"},
    {"paper baked field", "601ff122cc96d7e641d62f56f3ab1d1d4900cd2d8b44bafd55eb220e52ed56fb"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "ef3a304f878edfed4b6315ffc11094dde06231a4f24008c3a54b5860190f1da2"},
    {"paper renders", "ed7fda7250a1b4da85805c0c4ecbe2b4104d66e360e88647b9436e23ff9e08b6"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
