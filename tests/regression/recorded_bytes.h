#pragma once
#include <map>
#include <string>

// SHA-256 of the files of bytes_test.cpp, for each instruction set. Scene and fields were recorded at commit
// 07c747b; owners and all that is made with them, at the commit where Muon began to train the extractor's
// matrices; the logits of preset fast, at the commit that aligns the best cameras finely. AVX-512 is not
// recorded, for want of a machine that has it.
inline const std::map<std::string, std::string> kBytesV2{
    {"code baked field", "e26442e1977fc7c12dc57999b35e56c1cd15d9031d5d016972038d9b3c728518"},
    {"code logits", "9613e54e8692e34788c1420773b95ac1f73cad031192077e2866490bda867c3e"},
    {"code owner", "7d93be5dbf71220a5dd26118b7514153c369100f804bd41a38433ed5da88c08b"},
    {"code renders", "9a907db320b4130217845ba9208a200cd78e96eb059ccb7c6324e52cbcd31b8c"},
    {"fast baked field", "b5b1dec616150fa00c41aca751cb83206a38c968e4c80911552b67285063dfed"},
    {"fast logits", "9761dec62a5a130818fa5b19f5b40df9ec3409de9b78cbbe3ddef2b37fc05023"},
    {"fast owner", "ab8f0c665630754bf4a27782b7df777e8bb0823629d1ba6e993522341c8f542a"},
    {"fast renders", "18bb5ea15eb0558ec13b9f20f7a78f4b11edadd4e6cfdc8e9e6934b35bfc5761"},
    {"hash field", "7169f1e7a7340da7cd7253b251b0cd4a79ddbae0180376de07068fb54e49625e"},
    {"mlp field", "7b33409f716c7056416cecc68cb45c617c9aca7da414de414f01d9eeff7cdb82"},
    {"paper baked field", "927d32a0f8b8baa184b3b12886b68d6ab51660e5b9dcc9fdaece4805ad4c6ba8"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "8832ad2aaf0cf5a67b3e5cf139d284ff1bb027be25712b55daa76aac88f65a8f"},
    {"paper renders", "5b4700a52f6f706bc85a1b522db6d43158d065c9d08e1c4256cc4854b7c57a10"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
inline const std::map<std::string, std::string> kBytesV3{
    {"code baked field", "1cdc848f3df0227d0c0ef51de8d801dcfec6196e2c4bc140fdfc43414d33229e"},
    {"code logits", "8798f00cac051ef6e4f4ba6f06c2389cebdf7bce16bd67f3ed649cf481cbd2d3"},
    {"code owner", "984dc2b560f17c500cf72d6efcfcb3fed3f35fc6e1e909ce7b43f8a93e039e02"},
    {"code renders", "b5805b6e29fa89b77facf7acbe863b45cbee2ae39f5a6e5bb5cb04f8dbc245e2"},
    {"fast baked field", "cc5e45743009ea3516559663321dd6a92384c11f0c652bc3f2537fbd45a5a23f"},
    {"fast logits", "b3b16e73eb7e93f757a92f23904b5263992a2fa0d5cbf40a9841f8f8e1b6f3c5"},
    {"fast owner", "3f494d85d7d875c3b5fce6b197f43bbeae254c4823c4f55f4a6308f0be05245a"},
    {"fast renders", "aa69cfd97c3c0fc944813316056f603dfa28992a9f23993f7eab2ff091f086f1"},
    {"hash field", "ddb8c16b2d62994a59ed8aa4ae932d923e75564baf99a3cbcda6591352018d07"},
    {"mlp field", "75b9aa11ccbf62dada9278d143ad378beee4521b95c4db7fe9702982666dee32"},
    {"paper baked field", "601ff122cc96d7e641d62f56f3ab1d1d4900cd2d8b44bafd55eb220e52ed56fb"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "fb1cc7681d1f0734899f2397d4e96295e8496bd6b9f5e664518a5a4f815593d3"},
    {"paper renders", "ed7fda7250a1b4da85805c0c4ecbe2b4104d66e360e88647b9436e23ff9e08b6"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
